#pragma once
// The real hand hides what is virtual and behind it (requirements' V1, "which is nearer"): film shows the
// hand, but whatever is drawn over film would cover it. From the fingertips a hand is guessed (hand_shape.h);
// its outline, softened, with its depths, is a mask: over what is opaque the film is laid again, and what is
// transparent fades where it is behind the mask (emit_glsl). What is before the hand stays. Where fingertips
// are unsure the mask fades.
//
// The film itself could be segmented by colour; but the fingertips are known anyhow, in any light.

#include "client-hmd/render/frame.h"
#include "client-hmd/render/surface_pass.h"
#include "client-hmd/render/targets.h"

namespace handloft::client {

class HandOcclusionPass {
 public:
  static Result<HandOcclusionPass> create();

  /// After the film was drawn, before anything else: keeps the film and draws the mask, for this frame.
  /// False: no film, no hand, or switched off; then nothing else need be called. Leaves the picture bound.
  /// Errors: resource_exhausted.
  Result<bool> prepare(const Frame& frame, const EyeUniforms& eye, const Targets& targets);
  /// The mask for emit_glsl: coverage, and coverage times depth; 0 when there is none.
  GLuint mask() const { return mask_.id(); }
  /// The film again, over what is opaque and behind the hand. Leaves the picture bound.
  void cover(const Targets& targets) const;

 private:
  Status resize(const Targets& targets, int width_px, int height_px);
  void fullscreen(const GlProgram& program) const;

  GlProgram draw_, blur_, cover_;
  GlVertexArray array_, no_vertices_;
  GlBuffer vertices_, indices_;
  GlTexture film_, mask_, other_, depth_;
  GlFramebuffer mask_target_, other_target_, film_target_, picture_alone_;
  GLuint picture_ = 0;  ///< That picture_alone_ was made for.
  int width_px_ = 0, height_px_ = 0;
};

}  // namespace handloft::client
