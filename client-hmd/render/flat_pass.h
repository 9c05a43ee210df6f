#pragma once
// Rounded panels and text, flat: the HUD in pixels of the output, and the palette's cells on the table in
// metres.

#include "client-hmd/render/font_atlas.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/render/icon_pass.h"
#include "client-hmd/render/surface_pass.h"

namespace handloft::client {

class FlatPass {
 public:
  static Result<FlatPass> create();

  /// Into the linear picture, with depth test, blended: call after the table.
  void draw_palette(const Frame& frame, const EyeUniforms& eye);
  /// Cards in the room: into the linear picture, with depth test, blended.
  void draw_sheets(std::span<const SpaceSheet> sheets, const EyeUniforms& eye);
  /// Words beside icons: into the linear picture, blended; surfaces before them hide them.
  void draw_labels(std::span<const SpaceLabel> labels, const EyeUniforms& eye);
  /// Into the output (sRGB values), in its pixels.
  void draw_overlay(const Overlay& overlay, int width_px, int height_px);

  float measure(std::string_view utf8) const { return small_.atlas.measure(utf8); }

 private:
  struct Vertex {
    glm::vec3 position{0.0F};
    glm::vec2 uv{0.0F};         ///< Text: in the atlas. Panel: from its middle, in its unit.
    glm::vec2 half_size{0.0F};  ///< Panel only.
    float radius = -1.0F;       ///< Negative: text.
    glm::vec4 colour{0.0F};
  };
  struct Font {
    FontAtlas atlas;
    GlTexture texture;
  };
  /// Axes of a flat drawing in space: where its origin is and what a step right and down means.
  struct Sheet {
    glm::vec3 origin{0.0F};
    glm::vec3 right{1.0F, 0.0F, 0.0F};
    glm::vec3 down{0.0F, 1.0F, 0.0F};
    glm::vec3 at(float x, float y) const { return origin + x * right + y * down; }
  };

  void add_panel(const Sheet& sheet, const OverlayPanel& panel);
  void add_text(const Sheet& sheet, const Font& font, const OverlayText& text);
  void flush(const glm::mat4& clip_from_sheet, const Font& font);

  GlProgram program_;
  GlVertexArray array_;
  GlBuffer buffer_;
  Font small_;  ///< For the HUD: near its size on the screen.
  Font large_;  ///< For labels in space, with mipmaps.
  std::vector<Vertex> vertices_;
};

}  // namespace handloft::client
