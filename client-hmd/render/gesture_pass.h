#pragma once
// What hangs in the air while a hand works: the modification disk with its normal and, around it, the range
// of its influence (A13, A16); the stroke being drawn (A18, A24); brackets about the shape that a gesture
// would act on (A25). Drawn over the finished picture: what stands behind something shines through faintly,
// since a hand works inside its shapes.

#include <optional>

#include "client-hmd/render/frame.h"
#include "client-hmd/render/ribbon_pass.h"

namespace handloft::client {

/// The smallest box along the axes that holds what `entity` shows; nullopt when it shows nothing.
struct Box {
  glm::vec3 low{0.0F}, high{0.0F};
};
std::optional<Box> shown_box(const Entity& entity);

class GesturePass {
 public:
  static Result<GesturePass> create();

  /// Looks anew which shape is the target, and where it is.
  void update(const Scene& scene);
  /// Into the bound picture, whose depth is that of everything drawn before.
  void draw(const Frame& frame, const EyeUniforms& eye) const;

 private:
  void draw_disks(const Frame& frame, const EyeUniforms& eye, float opacity) const;

  GlProgram disk_;
  GlVertexArray no_vertices_;
  RibbonPass ribbons_;
  std::vector<Box> targets_;
};

}  // namespace handloft::client
