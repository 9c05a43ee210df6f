#include "client-hmd/render/flat_pass.h"

#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "client-hmd/render/palette_label.h"

namespace handloft::client {
namespace {

constexpr std::string_view font_family = "DejaVu Sans";
constexpr int small_font_px = 32;  ///< Twice the HUD's text: minified by mipmaps it stays smooth at any size.
constexpr int large_font_px = 96;

constexpr std::string_view vertex_glsl = R"glsl(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec2 a_uv;
layout(location = 2) in vec2 a_half_size;
layout(location = 3) in float a_radius;
layout(location = 4) in vec4 a_colour;
uniform mat4 u_clip_from_sheet;
out vec2 uv;
flat out vec2 half_size;
flat out float radius;
flat out vec4 colour;
void main() {
  uv = a_uv;
  half_size = a_half_size;
  radius = a_radius;
  colour = a_colour;
  gl_Position = u_clip_from_sheet * vec4(a_position, 1.0);
}
)glsl";

constexpr std::string_view fragment_glsl = R"glsl(
in vec2 uv;
flat in vec2 half_size;
flat in float radius;
flat in vec4 colour;
layout(location = 0) out vec4 out_colour;
uniform sampler2D u_font;
void main() {
  float ink = 1.0;
  if (radius < 0.0) {
    ink = texture(u_font, uv).r;
  } else {
    vec2 q = abs(uv) - half_size + radius;
    float outside = length(max(q, 0.0)) + min(max(q.x, q.y), 0.0) - radius;
    ink = 1.0 - smoothstep(-0.5, 0.5, outside / max(fwidth(outside), 1e-9));
  }
  out_colour = vec4(colour.rgb, colour.a * ink);
}
)glsl";

/// Every character on the palette.
std::string palette_characters() {
  std::string all;
  for (const PaletteCell& cell : table_palette) all.append(cell.label).append(cell.sign);
  return all;
}

Result<GlTexture> upload(const FontAtlas& atlas) {
  GlTexture texture = GlTexture::create();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, atlas.width(), atlas.height(), 0, GL_RED, GL_UNSIGNED_BYTE,
               atlas.coverage().data());
  glGenerateMipmap(GL_TEXTURE_2D);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 4);
  if (epoxy_has_gl_extension("GL_EXT_texture_filter_anisotropic") ||
      epoxy_has_gl_extension("GL_ARB_texture_filter_anisotropic")) {
    glTexParameterf(GL_TEXTURE_2D, GL_TEXTURE_MAX_ANISOTROPY_EXT, 4.0F);
  }
  return texture;
}

}  // namespace

Result<FlatPass> FlatPass::create() {
  FlatPass pass;
  const std::array vertex{vertex_glsl};
  const std::array fragment{fragment_glsl};
  Result<GlProgram> program = GlProgram::build("flat", vertex, fragment);
  if (!program) return program.error();
  pass.program_ = std::move(*program);
  pass.array_ = GlVertexArray::create();
  pass.buffer_ = GlBuffer::create();
  for (auto [font, height] :
       {std::pair{&pass.small_, small_font_px}, std::pair{&pass.large_, large_font_px}}) {
    Result<FontAtlas> atlas = FontAtlas::load(font_family, height, palette_characters());
    if (!atlas) return atlas.error();
    font->atlas = std::move(*atlas);
    Result<GlTexture> texture = upload(font->atlas);
    if (!texture) return texture.error();
    font->texture = std::move(*texture);
  }
  glBindVertexArray(pass.array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, pass.buffer_.id());
  const auto attribute = [](GLuint index, GLint count, std::size_t at) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                          reinterpret_cast<const void*>(at));
  };
  attribute(0, 3, offsetof(Vertex, position));
  attribute(1, 2, offsetof(Vertex, uv));
  attribute(2, 2, offsetof(Vertex, half_size));
  attribute(3, 1, offsetof(Vertex, radius));
  attribute(4, 4, offsetof(Vertex, colour));
  glBindVertexArray(0);
  return pass;
}

void FlatPass::add_panel(const Sheet& sheet, const OverlayPanel& panel) {
  const glm::vec2 half = 0.5F * panel.size;
  const glm::vec2 middle = panel.position + half;
  const float radius = std::min(panel.radius_px, std::min(half.x, half.y));
  // Room for the edge's smoothing on the outside.
  const float margin = 0.02F * std::max(panel.size.x, panel.size.y);
  const auto corner = [&](float sx, float sy) {
    const glm::vec2 local(sx * (half.x + margin), sy * (half.y + margin));
    return Vertex{sheet.at(middle.x + local.x, middle.y + local.y), local, half, radius, panel.fill};
  };
  const Vertex a = corner(-1, -1), b = corner(1, -1), c = corner(-1, 1), d = corner(1, 1);
  vertices_.insert(vertices_.end(), {a, b, c, c, b, d});
}

void FlatPass::add_text(const Sheet& sheet, const Font& font, const OverlayText& text) {
  const float scale = text.height_px / static_cast<float>(font.atlas.pixel_height());
  float pen = text.position.x;
  if (text.align != TextAlign::left) {
    const float width = font.atlas.measure(text.text) * text.height_px;
    pen -= text.align == TextAlign::centre ? 0.5F * width : width;
  }
  const auto atlas_w = static_cast<float>(font.atlas.width());
  const auto atlas_h = static_cast<float>(font.atlas.height());
  constexpr float border = 1.0F;  // A pixel round the glyph, for its smooth edge.
  for (const char32_t character : decode_utf8(text.text)) {
    const Glyph& glyph = font.atlas.glyph(character);
    const float x0 = pen + (glyph.left - border) * scale;
    const float y0 = text.position.y - (glyph.top + border) * scale;
    const float w = static_cast<float>(glyph.width) + 2 * border;
    const float h = static_cast<float>(glyph.height) + 2 * border;
    const auto corner = [&](float sx, float sy) {
      Vertex v;
      v.position = sheet.at(x0 + sx * w * scale, y0 + sy * h * scale);
      v.uv = {(static_cast<float>(glyph.x) - border + sx * w) / atlas_w,
              (static_cast<float>(glyph.y) - border + sy * h) / atlas_h};
      v.colour = text.colour;
      return v;
    };
    if (glyph.width > 0) {
      const Vertex a = corner(0, 0), b = corner(1, 0), c = corner(0, 1), d = corner(1, 1);
      vertices_.insert(vertices_.end(), {a, b, c, c, b, d});
    }
    pen += glyph.advance * scale;
  }
}

void FlatPass::flush(const glm::mat4& clip_from_sheet, const Font& font) {
  if (vertices_.empty()) return;
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  program_.use();
  program_.set("u_clip_from_sheet", clip_from_sheet);
  program_.set("u_font", 0);
  bind_texture(0, GL_TEXTURE_2D, font.texture.id());
  glBindVertexArray(array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, buffer_.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices_.size() * sizeof(Vertex)), vertices_.data(),
               GL_STREAM_DRAW);
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices_.size()));
  glBindVertexArray(0);
  glDisable(GL_BLEND);
  vertices_.clear();
}

void FlatPass::draw_sheets(std::span<const SpaceSheet> sheets, const EyeUniforms& eye) {
  for (const SpaceSheet& flat : sheets) {
    const Sheet sheet{flat.origin, flat.right, flat.down};
    for (const OverlayPanel& panel : flat.overlay.panels) add_panel(sheet, panel);
    for (const OverlayText& text : flat.overlay.texts) add_text(sheet, large_, text);
  }
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  glDepthFunc(GL_LEQUAL);  // Words lie in their card's plane.
  flush(eye.clip_from_eye * eye.eye_from_world, large_);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
}

void FlatPass::draw_palette(const Frame& frame, const EyeUniforms& eye) {
  if (frame.palette_page < first_palette_page) return;
  constexpr float lift_m = 0.0003F;  // Above the table's plane, so that depth decides for the cell.
  for (const PaletteCell& cell : table_palette) {
    if (!is_on_page(cell, frame.palette_page)) continue;
    const bool touched = frame.touched == cell.command;
    const auto w = static_cast<float>(cell.width_m);
    const auto h = static_cast<float>(cell.height_m);
    const Sheet sheet{{static_cast<float>(cell.centre_x_m), static_cast<float>(cell.centre_y_m), lift_m},
                      {1.0F, 0.0F, 0.0F},
                      {0.0F, -1.0F, 0.0F}};
    // Linear colours here: this goes into the lit picture.
    const glm::vec4 rim =
        touched ? glm::vec4(0.75F, 0.16F, 0.035F, 0.95F) : glm::vec4(0.10F, 0.13F, 0.18F, 0.55F);
    const glm::vec4 face =
        touched ? glm::vec4(1.0F, 0.86F, 0.76F, 0.97F) : glm::vec4(0.86F, 0.87F, 0.885F, 0.92F);
    const glm::vec4 ink =
        touched ? glm::vec4(0.42F, 0.06F, 0.01F, 1.0F) : glm::vec4(0.018F, 0.035F, 0.07F, 0.95F);
    constexpr float rim_m = 0.0007F;
    add_panel(sheet, {{-w / 2, -h / 2}, {w, h}, 0.006F, rim});
    add_panel(sheet, {{-w / 2 + rim_m, -h / 2 + rim_m}, {w - 2 * rim_m, h - 2 * rim_m}, 0.0055F, face});
    add_text(
        sheet, large_,
        {std::string(cell.sign), {0.0F, sign_baseline_share * h}, sign_share * h, ink, TextAlign::centre});
    const PaletteLabel label = fit_label(
        cell.label, label_room(w, h), [this](std::string_view text) { return large_.atlas.measure(text); });
    // In this sheet's units down the table, a unit is label_stretch metres.
    const Sheet stretched{sheet.origin, sheet.right, label_stretch * sheet.down};
    const float step = label_line_spacing * label.height_m;
    // Baselines such that the lines' middle is the middle of their room.
    float baseline = 0.5F * (label_top_share + label_bottom_share) * h / label_stretch +
                     0.36F * label.height_m - 0.5F * step * static_cast<float>(label.lines.size() - 1);
    for (const std::string& line : label.lines) {
      add_text(stretched, large_, {line, {0.0F, baseline}, label.height_m, ink, TextAlign::centre});
      baseline += step;
    }
  }
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  flush(eye.clip_from_eye * eye.eye_from_world, large_);
  glDepthMask(GL_TRUE);
}

void FlatPass::draw_labels(std::span<const SpaceLabel> labels, const EyeUniforms& eye) {
  const auto axis = [&eye](int row) {
    return glm::vec3(eye.eye_from_world[0][row], eye.eye_from_world[1][row], eye.eye_from_world[2][row]);
  };
  constexpr glm::vec4 face{0.93F, 0.935F, 0.94F, 0.85F}, ink{0.018F, 0.035F, 0.07F, 1.0F};
  for (const SpaceLabel& label : labels) {
    const Sheet sheet{label.position, axis(0), -axis(1)};
    const float h = label.height_m;
    const float width = large_.atlas.measure(label.text) * h;
    const glm::vec2 size{width + 0.6F * h, 1.3F * h};
    const float left = label.centred ? -0.5F * size.x : label.to_left ? -size.x : 0.0F;
    const auto faded = [&label](glm::vec4 colour) {
      return colour * glm::vec4(1.0F, 1.0F, 1.0F, label.opacity);
    };
    if (label.edge) {
      const glm::vec2 rim(0.11F * h);
      add_panel(sheet, {glm::vec2(left, -0.5F * size.y) - rim, size + 2.0F * rim, 0.46F * h,
                        faded(glm::vec4(*label.edge, 0.95F))});
    }
    add_panel(sheet, {{left, -0.5F * size.y}, size, 0.35F * h, faded(face)});
    add_text(sheet, large_, {label.text, {left + 0.3F * h, 0.36F * h}, h, faded(ink), TextAlign::left});
  }
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  // The text lies in its panel's plane.
  glDepthFunc(GL_LEQUAL);
  flush(eye.clip_from_eye * eye.eye_from_world, large_);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
}

void FlatPass::draw_overlay(const Overlay& overlay, int width_px, int height_px) {
  const Sheet sheet;
  for (const OverlayPanel& panel : overlay.panels) add_panel(sheet, panel);
  for (const OverlayText& text : overlay.texts) add_text(sheet, small_, text);
  glDisable(GL_DEPTH_TEST);
  flush(glm::ortho(0.0F, static_cast<float>(width_px), static_cast<float>(height_px), 0.0F, -1.0F, 1.0F),
        small_);
}

}  // namespace handloft::client
