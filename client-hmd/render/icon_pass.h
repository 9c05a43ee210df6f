#pragma once
// The icons of sculpted surfaces (D17), as the paper draws them: balls, arrows for normals and derivatives, a
// letter or two beside derivatives, and the lines of curves and regions on the surface. What a hand would
// pick has a halo, what it holds is larger and brighter. Their size is in millimetres, but never too small to
// see.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client-hmd/render/ball_pass.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/render/ribbon_pass.h"

namespace handloft::client {

/// A word in space, facing the eye.
struct SpaceLabel {
  std::string text;
  glm::vec3 position{0.0F};  ///< Of the edge where it is attached, at half its height.
  float height_m = 0.0F;
  bool to_left = false;  ///< It is attached at its right edge, else at its left one.
  bool centred = false;  ///< It is attached at its middle; goes before `to_left`.
  float opacity = 1.0F;
  std::optional<glm::vec3> edge;  ///< Colour of a rim around it, linear RGB; none: no rim.
};

/// How one icon is drawn for an eye.
struct IconLook {
  Ball ball;
  glm::vec3 arrow{0.0F};  ///< From the ball's centre; zero: none.
  float arrow_width_m = 0.0F;
  RibbonStyle line;
  float halo = 0.0F;  ///< Opacity.
};

/// Visible sizes of icons. Pure.
IconLook look_of(const SceneIcon& icon, const EyeUniforms& eye);
/// The labels of a scene's icons; those behind the eye are left out.
std::vector<SpaceLabel> icon_labels(const Scene& scene, const EyeUniforms& eye);

class IconPass {
 public:
  static Result<IconPass> create();

  /// With depth, opaque.
  void draw(const Scene& scene, const EyeUniforms& eye) const;
  /// The halos, blended over everything, so that what would be picked is seen behind a surface too.
  void draw_halos(const Scene& scene, const EyeUniforms& eye) const;

 private:
  BallPass balls_;
  RibbonPass ribbons_;
  GlProgram arrow_;
  GlProgram halo_;
  GlVertexArray no_vertices_;
};

}  // namespace handloft::client
