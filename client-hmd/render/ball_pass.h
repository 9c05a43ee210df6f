#pragma once
// Small lit balls, each one square towards the eye with the ball's depth: round at any size.

#include "client-hmd/render/gl.h"
#include "client-hmd/render/surface_pass.h"

namespace handloft::client {

struct Ball {
  glm::vec3 centre{0.0F};
  float radius_m = 0.0F;
  glm::vec3 colour{1.0F};  ///< Linear RGB.
  float opacity = 1.0F;
};

class BallPass {
 public:
  static Result<BallPass> create();

  /// Before the draws of one stage.
  void begin(const EyeUniforms& eye, Stage stage) const;
  void draw(const Ball& ball) const;

 private:
  GlProgram program_;
  GlVertexArray no_vertices_;
};

}  // namespace handloft::client
