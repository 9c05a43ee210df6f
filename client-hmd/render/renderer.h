#pragma once
// The one renderer, for windows and offscreen alike (V4). The picture is composed in linear light in this
// order: backdrop or film, table, palette, opaque things, transparent things by weighted blending (V2),
// cursor; then it is warped to the display time (V1), encoded to sRGB, and the HUD is laid over it.
//
// All calls from one thread with a current OpenGL 3.3 context, also the destructor.

#include <memory>

#include "client-hmd/render/frame.h"
#include "client-hmd/render/transparency.h"

namespace handloft::client {

/// Those of meshes that are new: the frame goes on without, or waits.
enum class Curvatures { as_ready, awaited };

struct RenderOptions {
  Transparency transparency = Transparency::weighted_blended;
  TransparencyWeights weights;
  /// The scene is drawn with this many pixels a side for each of the output and averaged: 1 while moving, 2
  /// for stills.
  int supersampling = 1;
  Curvatures curvatures = Curvatures::as_ready;
};

class Renderer {
 public:
  /// Errors: unsupported for less than OpenGL 3.3; not_found without a font; internal for a shader.
  static Result<std::unique_ptr<Renderer>> create();
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Draws into framebuffer `target` (0: the window) at the size of the eye's pinhole.
  Status draw(const Frame& frame, const RenderOptions& options, unsigned target = 0);
  /// The same into memory. Errors: invalid_argument for an impossible pinhole; resource_exhausted when it is
  /// too large.
  Result<Image> draw_to_image(const Frame& frame, const RenderOptions& options);
  /// Into a framebuffer of the renderer's own, without reading it back: for a frame loop without a window.
  Status draw_offscreen(const Frame& frame, const RenderOptions& options);

  /// Width of a line of the HUD's text, in multiples of its height.
  float measure_text(std::string_view utf8) const;

 private:
  struct Implementation;
  explicit Renderer(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::client
