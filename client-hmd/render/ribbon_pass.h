#pragma once
// Lines in space as ribbons of constant width on the screen. Kinds of curves differ in more than colour, so
// that they can be told apart without it: a profile stroke has light edges, a boundary is dashed, any other
// curve is a thin plain line.

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
    Vec3f position, next;
    float side;
    float along_m;  ///< From the line's beginning.
    float width, dash_m, edge;
    glm::vec3 colour;
  };
  std::vector<Vertex> vertices_;
};

class RibbonPass {
 public:
  static Result<RibbonPass> create();
  /// With the depth test as it is set. `opacity` 1: emitted for the opaque stage; below: blended over.
  void draw(const Ribbons& ribbons, const EyeUniforms& eye, float opacity) const;

 private:
  GlProgram program_;
  GlVertexArray array_;
  GlBuffer buffer_;
};

}  // namespace handloft::client
