#pragma once
// The cursor and other marks in space: fingertips as small lit balls, the ring that shows pressure, the plane
// of symmetry, and the curves of shapes.

#include "client-hmd/render/ball_pass.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/render/ribbon_pass.h"

namespace handloft::client {

class MarkPass {
 public:
  static Result<MarkPass> create();

  /// The curves of shapes: with depth.
  void draw_curves(const Frame& frame, const EyeUniforms& eye);
  /// Fingertips that are seen: with depth.
  void draw_fingertips(const Frame& frame, const EyeUniforms& eye);
  /// Fingertips that are predicted, and the plane of symmetry.
  void draw_transparent(const Frame& frame, const EyeUniforms& eye, Stage stage);
  /// The ring of pressure: over everything, since the eye steers by it.
  void draw_cursor(const Frame& frame, const EyeUniforms& eye);

 private:
  void draw_balls(const Frame& frame, const EyeUniforms& eye, Stage stage);

  GlProgram plane_;
  GlProgram ring_;
  GlVertexArray no_vertices_;
  BallPass balls_;
  RibbonPass ribbons_;
};

}  // namespace handloft::client
