#pragma once
// What lies behind and under the work: the filmed picture (V1) or, without one, a studio's backdrop; the
// table with its grid, and the soft shadow that the work casts on it, which tells how high it floats.
//
// The work is drawn once from straight above, whenever it has changed, as opacity and height. Blurred by
// different amounts, these give the shadow of the lamp overhead (the softer, the higher what throws it), the
// dark seam where something touches the table, and, for surfaces, how much of the sky is hidden by what is
// above them.

#include "client-hmd/render/frame.h"
#include "client-hmd/render/point_pass.h"
#include "client-hmd/render/surface_pass.h"

namespace handloft::client {

class StagePass {
 public:
  static Result<StagePass> create();

  /// Draws the scene from straight above into the shadow's texture. Leaves another framebuffer bound.
  void update_shadow(const Scene& scene, const SurfacePass& surfaces, const PointPass& points);
  /// The filmed picture, undistorted into the eye's pinhole, or the backdrop. No depth.
  void draw_background(const Frame& frame);
  /// Grid, shadow and depth of the table; the grid only without film.
  void draw_table(const Frame& frame, const EyeUniforms& eye) const;
  /// As last updated.
  SurroundingsMap surroundings() const;

 private:
  void frame_work(const Scene& scene, const SurfacePass& surfaces);

  GlProgram backdrop_;
  GlProgram film_;
  GlProgram table_;
  GlProgram blur_;
  GlVertexArray no_vertices_;
  GlTexture film_texture_;
  std::uint64_t film_serial_ = 0;
  GlTexture shadow_texture_;
  GlTexture blur_texture_;
  GlFramebuffer shadow_target_;
  GlFramebuffer blur_target_;
  glm::vec2 shadow_centre_{0.0F};       ///< Of the square that the shadow's picture shows, metres.
  float shadow_half_extent_m_ = 0.36F;  ///< Half its side.
};

}  // namespace handloft::client
