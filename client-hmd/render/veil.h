#pragma once
// What surfaces leave of the points behind them (V2). Surfaces are blended before points, since ink just
// before a nearly opaque layer is where the weighted average errs most; so points must be told of surfaces
// that are transparent: how much light comes through all of them at a pixel (exact, it is a product), and
// from which depth on (their mean, weighted by the square of the opacity, so that a faint rim before an
// opaque face counts for nothing). emit_glsl fades what is behind by it.

#include "client-hmd/render/gl.h"

namespace handloft::client {

class Veil {
 public:
  static Result<Veil> create();

  /// What surfaces left: the sums of a weighted pass over them (emit_glsl), what shines through in `sum`'s
  /// alpha, the sums of squared opacities without and with depths in `weight`'s green and blue; and their
  /// nearest layer, apart, with its opacity in alpha and its depth as drawn.
  struct Layers {
    GLuint sum = 0, weight = 0;
    GLuint front = 0, front_depth = 0;
  };
  /// `depth_terms`: of the projection, as in emit_glsl. Leaves another framebuffer bound. Errors:
  /// resource_exhausted.
  Status keep(const Layers& layers, const glm::vec2& depth_terms, int width_px, int height_px);
  /// Share of light that comes through, and depth in metres.
  GLuint texture() const { return texture_.id(); }

 private:
  GlProgram program_;
  GlVertexArray no_vertices_;
  GlTexture texture_;
  GlFramebuffer target_;
  int width_px_ = 0, height_px_ = 0;
};

}  // namespace handloft::client
