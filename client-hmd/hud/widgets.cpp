#include <imgui.h>
//
#include <imgui_stdlib.h>

#include <algorithm>
#include <cmath>

#include "client-hmd/hud/panel_parts.h"

namespace handloft::client {
namespace {

const char* begin_of(std::string_view text) {
  return text.data();
}
const char* end_of(std::string_view text) {
  return text.data() + text.size();
}

ImVec2 measure(ImFont* font, std::string_view text, float size = 0.0F) {
  if (text.empty()) return {0.0F, 0.0F};
  return font->CalcTextSizeA(size > 0.0F ? size : font->FontSize, 1e6F, 0.0F, begin_of(text), end_of(text));
}

void put(ImFont* font, float size, ImVec2 at, ImU32 ink, std::string_view text) {
  if (text.empty()) return;
  ImGui::GetWindowDrawList()->AddText(font, size, {std::round(at.x), std::round(at.y)}, ink, begin_of(text),
                                      end_of(text));
}

/// Two lines where one is too wide, broken at the space that makes the wider one narrowest.
std::pair<std::string_view, std::string_view> broken(ImFont* font, std::string_view label, float width) {
  if (measure(font, label).x <= width) return {label, {}};
  std::pair<std::string_view, std::string_view> best{label, {}};
  float narrowest = measure(font, label).x;
  for (std::size_t at = label.find(' '); at != std::string_view::npos; at = label.find(' ', at + 1)) {
    const float wider = std::max(measure(font, label.substr(0, at)).x, measure(font, label.substr(at + 1)).x);
    if (wider >= narrowest) continue;
    narrowest = wider;
    best = {label.substr(0, at), label.substr(at + 1)};
  }
  return best;
}

/// Small text in the middle of `centre_x`, made smaller where it is too wide.
void put_label(ImFont* font, std::string_view text, float centre_x, float y, float width, ImU32 ink) {
  const float natural = measure(font, text).x;
  const float size = natural > width ? font->FontSize * width / natural : font->FontSize;
  put(font, size, {centre_x - 0.5F * std::min(natural, width), y + 0.5F * (font->FontSize - size)}, ink,
      text);
}

void focus_ring(const PanelParts& parts, ImVec2 from, ImVec2 to, float rounding) {
  if (!ImGui::IsItemFocused() || !ImGui::GetIO().NavVisible) return;
  const float out = 0.12F * parts.em;
  ImGui::GetWindowDrawList()->AddRect({from.x - out, from.y - out}, {to.x + out, to.y + out},
                                      colour(parts.theme.accent), rounding + out, 0, 0.13F * parts.em);
}

struct Pressable {
  bool pressed = false, hovered = false, held = false;
  ImVec2 from, to;
};

Pressable pressable(PanelParts& parts, const std::string& name, ImVec2 size) {
  Pressable item;
  item.from = ImGui::GetCursorScreenPos();
  item.to = {item.from.x + size.x, item.from.y + size.y};
  item.pressed = ImGui::InvisibleButton(name.c_str(), {std::max(size.x, 1.0F), std::max(size.y, 1.0F)});
  item.hovered = ImGui::IsItemHovered();
  item.held = ImGui::IsItemActive();
  note_place(parts, name);
  return item;
}

}  // namespace

void PanelParts::ask(PanelRequest&& request) {
  requests.push_back(std::move(request));
}

ImU32 colour(std::uint32_t srgb, float opacity) {
  const glm::vec4 c = overlay_rgba(srgb, opacity);
  return ImGui::ColorConvertFloat4ToU32({c.r, c.g, c.b, c.a});
}

std::uint32_t tone_ink(const Theme& theme, Tone tone) {
  switch (tone) {
    case Tone::good:
      return theme.good_ink;
    case Tone::caution:
      return theme.caution_ink;
    case Tone::bad:
      return theme.bad_ink;
    case Tone::plain:
      break;
  }
  return theme.faint_ink;
}

void begin_panel(PanelParts& parts, const char* name, const PixelRect& place, Scrolling scrolling) {
  PixelRect shown = place;
  if (scrolling == Scrolling::vertical) {
    const auto known = parts.memory.heights.find(name);
    if (known != parts.memory.heights.end()) shown.size.y = std::min(shown.size.y, known->second);
  }
  parts.places["panel:" + std::string(name)] = shown;
  const ImVec2 from{shown.corner.x, shown.corner.y};
  const ImVec2 to{shown.corner.x + shown.size.x, shown.corner.y + shown.size.y};
  constexpr int shadow_layers = 5;
  for (int i = shadow_layers; i > 0; --i) {
    const float out = 0.09F * parts.em * static_cast<float>(i);
    ImGui::GetBackgroundDrawList()->AddRectFilled({from.x - out, from.y - 0.5F * out},
                                                  {to.x + out, to.y + 1.5F * out}, IM_COL32(8, 14, 24, 7),
                                                  panel_sizes.rounding * parts.em + out);
  }
  ImGui::SetNextWindowPos(from);
  ImGui::SetNextWindowSize({shown.size.x, shown.size.y});
  ImGuiWindowFlags flags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                           ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus;
  if (scrolling == Scrolling::vertical) flags &= ~ImGuiWindowFlags_NoScrollbar;
  if (scrolling == Scrolling::none) flags |= ImGuiWindowFlags_NoScrollWithMouse;
  ImGui::Begin(name, nullptr, flags);
}

void end_panel(PanelParts& parts, const char* name) {
  const ImGuiStyle& style = ImGui::GetStyle();
  parts.memory.heights[name] =
      std::ceil(ImGui::GetCursorPosY() - style.ItemSpacing.y + style.WindowPadding.y) + 1.0F;
  ImGui::End();
}

void note_place(PanelParts& parts, std::string name) {
  const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
  if (!ImGui::IsItemVisible()) return;
  parts.places[std::move(name)] = {{from.x, from.y}, {to.x - from.x, to.y - from.y}};
}

void heading(PanelParts& parts, std::string_view text) {
  ImGui::PushFont(parts.gui.fonts().bold);
  ImGui::TextUnformatted(begin_of(text), end_of(text));
  ImGui::PopFont();
}

void words(PanelParts& parts, std::string_view text, std::uint32_t ink) {
  if (text.empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, colour(ink));
  ImGui::PushTextWrapPos(0.0F);
  ImGui::TextUnformatted(begin_of(text), end_of(text));
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
  (void)parts;
}

void small_words(PanelParts& parts, std::string_view text, std::uint32_t ink) {
  ImGui::PushFont(parts.gui.fonts().small);
  words(parts, text, ink);
  ImGui::PopFont();
}

void gap(const PanelParts& parts, float lines) {
  ImGui::Dummy({0.0F, lines * parts.em});
}

void tip(PanelParts& parts, std::string_view title, std::string_view help, const std::string& reason) {
  if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled) || ImGui::GetIO().MouseDown[0]) return;
  ImGui::SetNextWindowSize({15.0F * parts.em, 0.0F});
  ImGui::BeginTooltip();
  heading(parts, title);
  words(parts, help, parts.theme.ink);
  words(parts, reason, parts.theme.caution_ink);
  ImGui::EndTooltip();
}

float tile_width(int columns) {
  const float spacing = ImGui::GetStyle().ItemSpacing.x * static_cast<float>(columns - 1);
  return std::floor((ImGui::GetContentRegionAvail().x - spacing) / static_cast<float>(columns));
}

bool tile(PanelParts& parts, const std::string& name, const TileWords& tile_words, Chosen chosen,
          ImVec2 size) {
  const Pressable item = pressable(parts, name, size);
  const bool possible = tile_words.reason.empty();
  const Theme& theme = parts.theme;
  const bool lit = chosen == Chosen::yes;
  std::uint32_t face = lit ? theme.accent : theme.raised;
  if (item.hovered && possible) face = lit ? theme.accent_hovered : theme.hovered;
  const float rounding = ImGui::GetStyle().FrameRounding;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  if (possible || lit) {
    list.AddRectFilled(item.from, item.to, colour(face), rounding);
  }
  if (!possible) list.AddRect(item.from, item.to, colour(theme.line, 0.8F), rounding);
  if (item.held && possible)
    list.AddRect(item.from, item.to, colour(theme.accent), rounding, 0, 0.1F * parts.em);
  focus_ring(parts, item.from, item.to, rounding);

  const std::uint32_t ink = lit ? theme.on_accent : possible ? theme.ink : theme.disabled_ink;
  const GuiFonts& fonts = parts.gui.fonts();
  const float centre = 0.5F * (item.from.x + item.to.x);
  const float inner = size.x - 0.5F * parts.em;
  const auto [first, second] = broken(fonts.small, tile_words.label, inner);
  const float line = fonts.small->FontSize;
  const float label_height = second.empty() ? line : 1.95F * line;
  // The sign's and the label's middle is the tile's.
  const float content = fonts.sign->FontSize + label_height;
  float y = item.from.y + 0.5F * (size.y - content) - 0.05F * parts.em;
  const float sign_width = measure(fonts.sign, tile_words.sign).x;
  put(fonts.sign, fonts.sign->FontSize, {centre - 0.5F * sign_width, y}, colour(ink, possible ? 1.0F : 0.75F),
      tile_words.sign);
  y += fonts.sign->FontSize + 0.05F * parts.em;
  put_label(fonts.small, first, centre, y, inner, colour(ink));
  if (!second.empty()) put_label(fonts.small, second, centre, y + 0.95F * line, inner, colour(ink));
  if (!tile_words.shortcut.empty() && size.x > 3.5F * parts.em) {
    const float key_size = 0.9F * fonts.small->FontSize;
    const float width = measure(fonts.small, tile_words.shortcut, key_size).x;
    if (width < 0.4F * size.x) {
      put(fonts.small, key_size, {item.to.x - width - 0.35F * parts.em, item.from.y + 0.2F * parts.em},
          colour(lit        ? theme.on_accent
                 : possible ? theme.faint_ink
                            : theme.disabled_ink),
          tile_words.shortcut);
    }
  }
  const std::string title =
      std::string(tile_words.label) + (tile_words.shortcut.empty() ? "" : "   " + tile_words.shortcut);
  if (item.hovered) tip(parts, title, tile_words.help, tile_words.reason);
  if (item.pressed && !possible)
    parts.memory.notices.tell(NoticeKind::refused, std::string(tile_words.label) + ": " + tile_words.reason,
                              parts.now);
  return item.pressed && possible;
}

bool text_button(PanelParts& parts, const std::string& name, std::string_view label, ButtonLook look,
                 float width, const std::string& reason) {
  const GuiFonts& fonts = parts.gui.fonts();
  const ImVec2 text = measure(fonts.text, label);
  const float wide = width > 0.0F ? width : text.x + 1.6F * parts.em;
  const ImVec2 size{wide, panel_sizes.button * parts.em};
  const Pressable item = pressable(parts, name, size);
  const bool possible = reason.empty();
  const Theme& theme = parts.theme;
  const bool primary = look == ButtonLook::primary && possible;
  std::uint32_t face = primary ? theme.accent : theme.raised;
  if (item.hovered && possible) face = primary ? theme.accent_hovered : theme.hovered;
  const float rounding = ImGui::GetStyle().FrameRounding;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  if (possible) list.AddRectFilled(item.from, item.to, colour(face), rounding);
  if (!possible) list.AddRect(item.from, item.to, colour(theme.line, 0.8F), rounding);
  focus_ring(parts, item.from, item.to, rounding);
  const std::uint32_t ink = primary ? theme.on_accent : possible ? theme.ink : theme.disabled_ink;
  const float room = wide - 0.6F * parts.em;
  const float size_px = text.x > room ? fonts.text->FontSize * room / text.x : fonts.text->FontSize;
  put(fonts.text, size_px,
      {0.5F * (item.from.x + item.to.x) - 0.5F * std::min(text.x, room),
       0.5F * (item.from.y + item.to.y) - 0.5F * size_px},
      colour(ink), label);
  if (!possible) tip(parts, label, {}, reason);
  if (item.pressed && !possible) parts.memory.notices.tell(NoticeKind::refused, reason, parts.now);
  return item.pressed && possible;
}

std::optional<std::size_t> segments(PanelParts& parts, const std::string& name,
                                    std::span<const std::string_view> labels, std::size_t chosen) {
  std::optional<std::size_t> pressed;
  const GuiFonts& fonts = parts.gui.fonts();
  const float width = ImGui::GetContentRegionAvail().x;
  const float each = std::floor(width / static_cast<float>(std::max<std::size_t>(labels.size(), 1)));
  const float height = panel_sizes.button * parts.em;
  const float rounding = ImGui::GetStyle().FrameRounding;
  const ImVec2 begin = ImGui::GetCursorScreenPos();
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(begin, {begin.x + each * static_cast<float>(labels.size()), begin.y + height},
                     colour(parts.theme.raised), rounding);
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(0.0F, ImGui::GetStyle().ItemSpacing.y));
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (i > 0) ImGui::SameLine();
    const Pressable item = pressable(parts, name + ":" + std::string(labels[i]), {each, height});
    const bool lit = i == chosen;
    const float inset = 0.14F * parts.em;
    const ImVec2 from{item.from.x + inset, item.from.y + inset}, to{item.to.x - inset, item.to.y - inset};
    if (lit) list.AddRectFilled(from, to, colour(parts.theme.accent), rounding - 0.5F * inset);
    if (!lit && item.hovered)
      list.AddRectFilled(from, to, colour(parts.theme.hovered), rounding - 0.5F * inset);
    focus_ring(parts, from, to, rounding);
    put_label(fonts.small, labels[i], 0.5F * (item.from.x + item.to.x),
              0.5F * (item.from.y + item.to.y - fonts.small->FontSize), each - 0.5F * parts.em,
              colour(lit ? parts.theme.on_accent : parts.theme.ink));
    if (item.pressed && !lit) pressed = i;
  }
  ImGui::PopStyleVar();
  return pressed;
}

bool toggle(PanelParts& parts, const std::string& name, std::string_view label, bool on) {
  const float width = ImGui::GetContentRegionAvail().x;
  const float height = 1.9F * parts.em;
  const Pressable item = pressable(parts, name, {width, height});
  const Theme& theme = parts.theme;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const float rounding = ImGui::GetStyle().FrameRounding;
  if (item.hovered) {
    list.AddRectFilled({item.from.x - 0.35F * parts.em, item.from.y},
                       {item.to.x + 0.35F * parts.em, item.to.y}, colour(theme.hovered, 0.6F), rounding);
  }
  focus_ring(parts, item.from, item.to, rounding);
  ImFont* font = parts.gui.fonts().text;
  put(font, font->FontSize, {item.from.x, 0.5F * (item.from.y + item.to.y - font->FontSize)},
      colour(theme.ink), label);
  const float track_w = 2.2F * parts.em, track_h = 1.2F * parts.em;
  const ImVec2 track{item.to.x - track_w, 0.5F * (item.from.y + item.to.y - track_h)};
  const ImVec2 track_to{track.x + track_w, track.y + track_h};
  list.AddRectFilled(track, track_to, colour(on ? theme.accent : theme.raised), 0.5F * track_h);
  if (!on) list.AddRect(track, track_to, colour(theme.disabled_ink), 0.5F * track_h);
  const float knob = 0.36F * track_h;
  const ImVec2 centre{on ? track_to.x - 0.5F * track_h : track.x + 0.5F * track_h, track.y + 0.5F * track_h};
  list.AddCircleFilled(centre, knob, colour(on ? theme.on_accent : theme.disabled_ink), 24);
  return item.pressed;
}

bool choice_row(PanelParts& parts, const std::string& name, std::string_view label, Chosen chosen) {
  const float width = ImGui::GetContentRegionAvail().x;
  const float height = 1.8F * parts.em;
  const Pressable item = pressable(parts, name, {width, height});
  const Theme& theme = parts.theme;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const float rounding = ImGui::GetStyle().FrameRounding;
  const bool lit = chosen == Chosen::yes;
  if (lit || item.hovered) {
    list.AddRectFilled(item.from, item.to, colour(lit ? theme.chosen : theme.hovered, lit ? 1.0F : 0.7F),
                       rounding);
  }
  focus_ring(parts, item.from, item.to, rounding);
  const float middle = 0.5F * (item.from.y + item.to.y);
  const float radius = 0.38F * parts.em;
  const ImVec2 dot{item.from.x + 0.5F * parts.em + radius, middle};
  list.AddCircle(dot, radius, colour(lit ? theme.accent : theme.disabled_ink), 24, 0.09F * parts.em);
  if (lit) list.AddCircleFilled(dot, 0.55F * radius, colour(theme.accent), 24);
  ImFont* font = parts.gui.fonts().text;
  put(font, font->FontSize, {dot.x + radius + 0.55F * parts.em, middle - 0.5F * font->FontSize},
      colour(theme.ink), label);
  return item.pressed;
}

void gauge_row(PanelParts& parts, const Gauge& gauge) {
  const Theme& theme = parts.theme;
  const float width = ImGui::GetContentRegionAvail().x;
  const ImVec2 from = ImGui::GetCursorScreenPos();
  ImGui::Dummy({width, 1.75F * parts.em});
  note_place(parts, "gauge:" + std::string(gauge.label));
  ImFont* small = parts.gui.fonts().small;
  put(small, small->FontSize, from, colour(theme.faint_ink), gauge.label);
  const float value_width = measure(small, gauge.words).x;
  put(small, small->FontSize, {from.x + width - value_width, from.y}, colour(theme.ink), gauge.words);
  const float bar = 0.42F * parts.em;
  const ImVec2 bar_from{from.x, from.y + 1.2F * parts.em}, bar_to{from.x + width, bar_from.y + bar};
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(bar_from, bar_to, colour(theme.line), 0.5F * bar);
  const SceneColours& scene = scene_colours(parts.facts.colours);
  const float filled = static_cast<float>(gauge.value) * width;
  const std::uint32_t fill = gauge.active ? scene.pressing : theme.accent;
  if (filled > bar) list.AddRectFilled(bar_from, {from.x + filled, bar_to.y}, colour(fill), 0.5F * bar);
  // Its end is also where its knob is, so that the length is seen on any ground.
  const ImVec2 knob{from.x + std::clamp(filled, 0.5F * bar, width - 0.5F * bar),
                    0.5F * (bar_from.y + bar_to.y)};
  list.AddCircleFilled(knob, 0.95F * bar, colour(theme.ground), 24);
  list.AddCircle(knob, 0.95F * bar, colour(fill), 24, 0.14F * parts.em);
}

bool text_field(PanelParts& parts, const std::string& name, const char* hint, std::string& text) {
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
  ImGui::PushStyleColor(ImGuiCol_TextDisabled, colour(parts.theme.faint_ink));
  const bool changed = ImGui::InputTextWithHint(("##" + name).c_str(), hint, &text);
  ImGui::PopStyleColor();
  note_place(parts, name);
  const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
  const bool active = ImGui::IsItemActive();
  ImGui::GetWindowDrawList()->AddRect(from, to,
                                      colour(active ? parts.theme.accent : parts.theme.disabled_ink),
                                      ImGui::GetStyle().FrameRounding, 0, active ? 0.12F * parts.em : 1.0F);
  constexpr std::size_t longest = 200;
  if (text.size() > longest) {
    std::size_t end = longest;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
    text.resize(end);
  }
  return changed;
}

}  // namespace handloft::client
