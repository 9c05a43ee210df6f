#pragma once
// Lines in space as ribbons of constant width on the screen, mitred where they bend and round at their ends,
// with soft edges: one pixel of falloff, blended. A width is told in pixels of a picture 720 high and grows
// with the picture, so that it is the same share of the view in mono, in stereo and in stills. Kinds of
// curves differ in more than colour, so that they can be told apart without it: a profile stroke has light
// edges, a boundary is dashed, any other curve is a thin plain line.

#include <cstdint>
#include <span>
#include <vector>

#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/gl.h"

namespace handloft::client {

struct EyeUniforms;  // surface_pass.h

struct RibbonStyle {
  glm::vec3 colour{0.0F};  ///< Linear RGB.
  float width = 2.5F;      ///< Pixels of a picture 720 high; grows with the picture.
  float dash_m = 0.0F;     ///< Length of a dash with its gap; 0: a solid line.
  float edge = 0.0F;       ///< Share of the half width that is light, for contrast on any ground; 0: none.
};

/// How a kind is drawn; `colour_rgba` as in SceneCurve.
RibbonStyle ribbon_style(CurveKind kind, std::uint32_t colour_rgba);

/// Lines gathered for one draw call.
class Ribbons {
 public:
  void add(std::span<const Vec3f> points, bool closed, const RibbonStyle& style);
  void add_segment(const glm::vec3& from, const glm::vec3& to, const RibbonStyle& style);
  bool empty() const { return vertices_.empty(); }

 private:
  friend class RibbonPass;
  struct Vertex {
    Vec3f before, position, after;  ///< Neighbours on the line; at an end the place itself.
    float side;                     ///< -1 or 1
    float cap;                      ///< -1 or 1: pushed out at the beginning or end; else 0.
    float along_m;                  ///< From the line's beginning.
    float width, dash_m, edge;
    glm::vec3 colour;
  };
  std::vector<Vertex> vertices_;
};

class RibbonPass {
 public:
  static Result<RibbonPass> create();
  /// Blended over what is there; with the depth test and the depth mask as they are set.
  void draw(const Ribbons& ribbons, const EyeUniforms& eye, float opacity) const;

 private:
  GlProgram program_;
  GlVertexArray array_;
  GlBuffer buffer_;
};

}  // namespace handloft::client
