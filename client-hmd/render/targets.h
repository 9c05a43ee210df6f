#pragma once
// The pictures that a frame is composed in: the linear one with depth, the sums of weighted blending, and the
// layers of depth peeling.

#include <array>

#include "client-hmd/render/gl.h"
#include "client-hmd/render/image.h"

namespace handloft::client {

class Targets {
 public:
  /// Errors: resource_exhausted when the card refuses the size.
  Status resize(int width_px, int height_px);

  void bind_picture() const { glBindFramebuffer(GL_FRAMEBUFFER, picture_target_.id()); }
  void bind_weighted() const { glBindFramebuffer(GL_FRAMEBUFFER, weighted_target_.id()); }

  /// Makes the layers on first use and clears the sum and the depth before the first layer.
  void begin_peeling();
  void bind_layer(int layer) const { glBindFramebuffer(GL_FRAMEBUFFER, layer_targets_[parity(layer)].id()); }
  void bind_peeled_sum() const { glBindFramebuffer(GL_FRAMEBUFFER, peeled_target_.id()); }

  GLuint picture() const { return picture_.id(); }
  GLuint opaque_depth() const { return depth_.id(); }
  GLuint sum() const { return sum_.id(); }
  GLuint weight() const { return weight_.id(); }
  GLuint layer_colour() const { return layer_colour_.id(); }
  GLuint last_layer_depth(int layer) const { return layer_depths_[parity(layer + 1)].id(); }

 private:
  static std::size_t parity(int layer) { return static_cast<std::size_t>(layer) % 2; }

  int width_px_ = 0;
  int height_px_ = 0;
  GlTexture picture_, depth_, sum_, weight_;
  GlFramebuffer picture_target_, weighted_target_;
  GlTexture layer_colour_;
  std::array<GlTexture, 2> layer_depths_;
  std::array<GlFramebuffer, 2> layer_targets_;
  GlFramebuffer peeled_target_;
};

/// An 8-bit picture of the output's size, for drawing without a window.
class OutputTarget {
 public:
  /// Errors: resource_exhausted when the card refuses the size.
  Status resize(int width_px, int height_px);
  /// Binds it and makes it black and transparent.
  void clear() const;
  /// Rows from the top, opaque.
  Image read() const;
  GLuint framebuffer() const { return target_.id(); }
  GLuint texture() const { return colour_.id(); }

 private:
  int width_px_ = 0;
  int height_px_ = 0;
  GlTexture colour_;
  GlFramebuffer target_;
};

}  // namespace handloft::client
