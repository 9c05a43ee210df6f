#include "client-hmd/hud/gui.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client-hmd/render/font_atlas.h"
#include "common/base/table_palette.h"

namespace handloft::client {
namespace {

constexpr std::string_view vertex_glsl = R"glsl(
layout(location = 0) in vec2 a_position;
layout(location = 1) in vec2 a_uv;
layout(location = 2) in vec4 a_colour;
uniform vec2 u_size_px;
out vec2 uv;
out vec4 colour;
void main() {
  uv = a_uv;
  colour = a_colour;
  gl_Position = vec4(2.0 * a_position.x / u_size_px.x - 1.0, 1.0 - 2.0 * a_position.y / u_size_px.y, 0.0, 1.0);
}
)glsl";

constexpr std::string_view fragment_glsl = R"glsl(
in vec2 uv;
in vec4 colour;
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_font;
void main() { out_colour = vec4(colour.rgb, colour.a * texture(u_font, uv).r); }
)glsl";

// Basic Latin to Latin Extended-A, Greek, Cyrillic, general punctuation, superscripts, arrows, mathematics,
// technical, shapes, symbols: what names, words and signs of the panels are made of.
constexpr std::array<ImWchar, 17> text_ranges{0x0020, 0x017F, 0x0370, 0x04FF, 0x2010, 0x2044,
                                              0x2070, 0x208E, 0x2190, 0x22FF, 0x2300, 0x23FF,
                                              0x25A0, 0x27BF, 0x2A2F, 0x2A2F, 0};

struct NamedKey {
  std::string_view name;
  int index;
  int imgui;
};
constexpr int key_control_base = 300;  ///< Above every ASCII code: indices of ImGuiIO::KeysDown.
constexpr std::array named_keys{
    NamedKey{"Tab", key_control_base + 0, ImGuiKey_Tab},
    NamedKey{"Left", key_control_base + 1, ImGuiKey_LeftArrow},
    NamedKey{"Right", key_control_base + 2, ImGuiKey_RightArrow},
    NamedKey{"Up", key_control_base + 3, ImGuiKey_UpArrow},
    NamedKey{"Down", key_control_base + 4, ImGuiKey_DownArrow},
    NamedKey{"PageUp", key_control_base + 5, ImGuiKey_PageUp},
    NamedKey{"PageDown", key_control_base + 6, ImGuiKey_PageDown},
    NamedKey{"Home", key_control_base + 7, ImGuiKey_Home},
    NamedKey{"End", key_control_base + 8, ImGuiKey_End},
    NamedKey{"Delete", key_control_base + 9, ImGuiKey_Delete},
    NamedKey{"Backspace", key_control_base + 10, ImGuiKey_Backspace},
    NamedKey{"Space", key_control_base + 11, ImGuiKey_Space},
    NamedKey{"Enter", key_control_base + 12, ImGuiKey_Enter},
    NamedKey{"Escape", key_control_base + 13, ImGuiKey_Escape},
    NamedKey{"A", 'A', ImGuiKey_A},
    NamedKey{"C", 'C', ImGuiKey_C},
    NamedKey{"V", 'V', ImGuiKey_V},
    NamedKey{"X", 'X', ImGuiKey_X},
    NamedKey{"Y", 'Y', ImGuiKey_Y},
    NamedKey{"Z", 'Z', ImGuiKey_Z},
};

int button_index(PointerButton button) {
  switch (button) {
    case PointerButton::left:
      return 0;
    case PointerButton::right:
      return 1;
    case PointerButton::middle:
      return 2;
  }
  return 0;
}

/// What a key writes: what stands on it, small without shift. Empty for keys with a name.
std::u32string written(const KeyChanged& key, const Modifiers& modifiers) {
  if (!key.down || modifiers.control || modifiers.alt) return {};
  if (key.key == "Space") return U" ";
  std::u32string characters = decode_utf8(key.key);
  if (characters.size() != 1) return {};
  char32_t& c = characters.front();
  const bool capital = (c >= U'A' && c <= U'Z') || (c >= 0xC0 && c <= 0xDE && c != 0xD7);
  if (capital && !modifiers.shift) c += 0x20;  // Latin 1: small letters follow at this distance.
  return characters;
}

ImVec4 imgui_colour(std::uint32_t srgb, float opacity = 1.0F) {
  const glm::vec4 c = overlay_rgba(srgb, opacity);
  return {c.r, c.g, c.b, c.a};
}

}  // namespace

Result<std::unique_ptr<Gui>> Gui::create() {
  std::unique_ptr<Gui> gui(new Gui());
  gui->text_file_ = find_font_file("DejaVu Sans");
  gui->bold_file_ = find_font_file("DejaVu Sans:bold");
  if (gui->text_file_.empty() || gui->bold_file_.empty()) {
    return make_error(ErrorCode::not_found,
                      "found no font, expected DejaVu Sans (package fonts-dejavu-core)");
  }
  const std::array vertex{vertex_glsl};
  const std::array fragment{fragment_glsl};
  Result<GlProgram> program = GlProgram::build("gui", vertex, fragment);
  if (!program) return program.error();
  gui->program_ = std::move(*program);
  gui->array_ = GlVertexArray::create();
  gui->vertices_ = GlBuffer::create();
  gui->indices_ = GlBuffer::create();
  gui->font_texture_ = GlTexture::create();
  glBindVertexArray(gui->array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, gui->vertices_.id());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, gui->indices_.id());
  const auto attribute = [](GLuint index, GLint count, GLenum type, GLboolean normalised, std::size_t at) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, type, normalised, sizeof(ImDrawVert),
                          reinterpret_cast<const void*>(at));
  };
  attribute(0, 2, GL_FLOAT, GL_FALSE, offsetof(ImDrawVert, pos));
  attribute(1, 2, GL_FLOAT, GL_FALSE, offsetof(ImDrawVert, uv));
  attribute(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(ImDrawVert, col));
  glBindVertexArray(0);

  gui->atlas_ = std::make_unique<ImFontAtlas>();
  gui->context_ = ImGui::CreateContext(gui->atlas_.get());
  ImGui::SetCurrentContext(gui->context_);
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // Nothing is written behind people's backs.
  io.LogFilename = nullptr;
  io.ConfigInputTextCursorBlink = false;  // Calm, and pictures of it are the same every time.
  io.BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;
  for (const NamedKey& key : named_keys) io.KeyMap[key.imgui] = key.index;
  return gui;
}

Gui::~Gui() {
  if (context_ != nullptr) ImGui::DestroyContext(context_);
}

Status Gui::load_fonts(float text_px) {
  atlas_->Clear();
  atlas_->Flags |= ImFontAtlasFlags_NoMouseCursors;
  const auto add = [this](const std::string& file, float height) {
    ImFontConfig config;
    config.OversampleH = 2;
    config.OversampleV = 1;
    config.PixelSnapH = false;
    config.EllipsisChar = 0x2026;
    return atlas_->AddFontFromFileTTF(file.c_str(), std::round(height), &config, text_ranges.data());
  };
  fonts_.text = add(text_file_, text_px);
  fonts_.bold = add(bold_file_, text_px);
  fonts_.small = add(text_file_, small_text_share * text_px);
  fonts_.sign = add(text_file_, sign_share_of_text * text_px);
  if (fonts_.text == nullptr || fonts_.bold == nullptr || fonts_.small == nullptr || fonts_.sign == nullptr) {
    return make_error(ErrorCode::io, "cannot read the font " + text_file_);
  }
  unsigned char* pixels = nullptr;
  int width = 0, height = 0;
  atlas_->GetTexDataAsAlpha8(&pixels, &width, &height);
  glBindTexture(GL_TEXTURE_2D, font_texture_.id());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, width, height, 0, GL_RED, GL_UNSIGNED_BYTE, pixels);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  atlas_->ClearTexData();  // The card has it now.
  atlas_->ClearInputData();
  ImGui::GetIO().FontDefault = fonts_.text;
  text_px_ = text_px;
  return {};
}

void Gui::apply_style(const Theme& theme, float text_px) {
  ImGuiStyle& style = ImGui::GetStyle();
  style = ImGuiStyle();
  const float em = text_px;
  style.WindowPadding = {panel_sizes.padding * em, panel_sizes.padding * em};
  style.WindowRounding = panel_sizes.rounding * em;
  style.ChildRounding = 0.0F;
  style.PopupRounding = 0.45F * em;
  style.FrameRounding = 0.4F * em;
  style.ScrollbarRounding = em;
  style.GrabRounding = em;
  style.WindowBorderSize = 1.0F;
  style.PopupBorderSize = 1.0F;
  style.ChildBorderSize = 0.0F;
  style.FrameBorderSize = 0.0F;
  style.FramePadding = {0.6F * em, 0.42F * em};
  style.ItemSpacing = {0.4F * em, 0.4F * em};
  style.ItemInnerSpacing = {0.4F * em, 0.3F * em};
  style.ScrollbarSize = 0.6F * em;
  style.GrabMinSize = 1.1F * em;
  style.WindowMinSize = {1.0F, 1.0F};
  style.MouseCursorScale = 1.0F;
  auto* colours = static_cast<ImVec4*>(style.Colors);
  const auto set = [colours](int slot, const ImVec4& colour) { colours[slot] = colour; };
  set(ImGuiCol_Text, imgui_colour(theme.ink));
  set(ImGuiCol_TextDisabled, imgui_colour(theme.disabled_ink));
  set(ImGuiCol_WindowBg, imgui_colour(theme.ground, theme.ground_opacity));
  set(ImGuiCol_ChildBg, imgui_colour(theme.ground, 0.0F));
  set(ImGuiCol_PopupBg, imgui_colour(theme.ground, 0.99F));
  set(ImGuiCol_Border, imgui_colour(theme.line, 0.9F));
  set(ImGuiCol_FrameBg, imgui_colour(theme.raised));
  set(ImGuiCol_FrameBgHovered, imgui_colour(theme.hovered));
  set(ImGuiCol_FrameBgActive, imgui_colour(theme.hovered));
  set(ImGuiCol_ScrollbarBg, imgui_colour(theme.ground, 0.0F));
  set(ImGuiCol_ScrollbarGrab, imgui_colour(theme.line));
  set(ImGuiCol_ScrollbarGrabHovered, imgui_colour(theme.disabled_ink));
  set(ImGuiCol_ScrollbarGrabActive, imgui_colour(theme.accent));
  set(ImGuiCol_SliderGrab, imgui_colour(theme.accent));
  set(ImGuiCol_SliderGrabActive, imgui_colour(theme.accent_hovered));
  set(ImGuiCol_TextSelectedBg, imgui_colour(theme.accent, 0.35F));
  set(ImGuiCol_NavHighlight, imgui_colour(theme.accent));
  set(ImGuiCol_NavWindowingHighlight, imgui_colour(theme.accent));
}

void Gui::add(const InputEvent& event) {
  waiting_.push_back(event);
}

bool Gui::apply(const InputEvent& event, std::set<std::string>& changed) {
  ImGuiIO& io = ImGui::GetIO();
  const auto first_time = [&changed](const std::string& what) { return changed.insert(what).second; };
  if (const auto* moved = std::get_if<PointerMoved>(&event.what)) {
    // A move after a press is another frame's: the press was where it was.
    if (changed.count("button") != 0) return false;
    io.MousePos = {static_cast<float>(moved->at_px.x), static_cast<float>(moved->at_px.y)};
  } else if (const auto* button = std::get_if<ButtonChanged>(&event.what)) {
    if (!first_time("button")) return false;
    io.MousePos = {static_cast<float>(button->at_px.x), static_cast<float>(button->at_px.y)};
    io.MouseDown[button_index(button->button)] = button->down;
  } else if (const auto* wheel = std::get_if<WheelTurned>(&event.what)) {
    io.MouseWheel += static_cast<float>(wheel->steps);
  } else if (const auto* key = std::get_if<KeyChanged>(&event.what)) {
    if (!key->repeat && !first_time(key->key)) return false;
    const auto known = std::find_if(named_keys.begin(), named_keys.end(),
                                    [key](const NamedKey& one) { return one.name == key->key; });
    if (known != named_keys.end()) io.KeysDown[known->index] = key->down;
    if (io.WantTextInput) {
      for (const char32_t character : written(*key, event.modifiers)) io.AddInputCharacter(character);
    }
  } else if (std::holds_alternative<FocusLost>(event.what)) {
    io.MousePos = {-std::numeric_limits<float>::max(), -std::numeric_limits<float>::max()};
    std::fill(std::begin(io.MouseDown), std::end(io.MouseDown), false);
    std::fill(std::begin(io.KeysDown), std::end(io.KeysDown), false);
  }
  io.KeyShift = event.modifiers.shift;
  io.KeyCtrl = event.modifiers.control;
  io.KeyAlt = event.modifiers.alt;
  return true;
}

Status Gui::begin(const GuiFrame& frame, const Theme& theme) {
  ImGui::SetCurrentContext(context_);
  ImGuiIO& io = ImGui::GetIO();
  if (frame.text_px != text_px_) {
    if (const Status loaded = load_fonts(frame.text_px); !loaded) return loaded;
  }
  apply_style(theme, frame.text_px);
  io.DisplaySize = {static_cast<float>(std::max(frame.width_px, 1)),
                    static_cast<float>(std::max(frame.height_px, 1))};
  constexpr double shortest_s = 1e-4, longest_s = 0.5;  // ImGui wants some time to pass; a pause is no time.
  io.DeltaTime = static_cast<float>(
      std::isfinite(frame.seconds) ? std::clamp(frame.seconds, shortest_s, longest_s) : shortest_s);
  std::set<std::string> changed;
  while (!waiting_.empty() && apply(waiting_.front(), changed)) waiting_.pop_front();
  ImGui::NewFrame();
  return {};
}

void Gui::end(unsigned target) {
  ImGui::Render();
  glBindFramebuffer(GL_FRAMEBUFFER, target);
  draw(*ImGui::GetDrawData());
}

void Gui::draw(const ImDrawData& data) {
  const auto width = static_cast<int>(data.DisplaySize.x), height = static_cast<int>(data.DisplaySize.y);
  glViewport(0, 0, width, height);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glEnable(GL_SCISSOR_TEST);
  program_.use();
  program_.set("u_size_px", glm::vec2(data.DisplaySize.x, data.DisplaySize.y));
  program_.set("u_font", 0);
  bind_texture(0, GL_TEXTURE_2D, font_texture_.id());
  glBindVertexArray(array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.id());
  for (int i = 0; i < data.CmdListsCount; ++i) {
    const ImDrawList& list = *data.CmdLists[i];
    glBufferData(GL_ARRAY_BUFFER, list.VtxBuffer.size_in_bytes(), list.VtxBuffer.Data, GL_STREAM_DRAW);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, list.IdxBuffer.size_in_bytes(), list.IdxBuffer.Data,
                 GL_STREAM_DRAW);
    for (const ImDrawCmd& command : list.CmdBuffer) {
      const auto left = static_cast<int>(command.ClipRect.x), top = static_cast<int>(command.ClipRect.y);
      const auto right = static_cast<int>(command.ClipRect.z), bottom = static_cast<int>(command.ClipRect.w);
      if (command.UserCallback != nullptr || right <= left || bottom <= top) continue;
      glScissor(left, height - bottom, right - left, bottom - top);
      constexpr GLenum index_type = sizeof(ImDrawIdx) == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
      glDrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(command.ElemCount), index_type,
                               reinterpret_cast<const void*>(command.IdxOffset * sizeof(ImDrawIdx)),
                               static_cast<GLint>(command.VtxOffset));
    }
  }
  glBindVertexArray(0);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
}

bool Gui::takes_text() const {
  ImGui::SetCurrentContext(context_);
  return ImGui::GetIO().WantTextInput;
}

void Gui::navigate_by_keys(bool on) {
  ImGui::SetCurrentContext(context_);
  ImGuiIO& io = ImGui::GetIO();
  if (on) {
    io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  } else {
    io.ConfigFlags &= ~ImGuiConfigFlags_NavEnableKeyboard;
  }
}

}  // namespace handloft::client
