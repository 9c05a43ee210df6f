#pragma once
// The one renderer, for windows and offscreen alike (V4). The picture is composed in linear light in this
// order: backdrop or film, table, palette, opaque things, transparent things by weighted blending (V2),
// cursor. That is draw_scene(). present() then turns it to the display time (V1), bends it for a lens (V4),
// encodes it to sRGB and lays the HUD over it: short, so that the turn can be asked for as late as possible.
//
// All calls from one thread with a current OpenGL 3.3 context, also the destructor.

#include <memory>

#include "client-hmd/render/frame.h"
#include "client-hmd/render/point_pass.h"
#include "client-hmd/render/presentation.h"
#include "client-hmd/render/transparency.h"

namespace handloft::client {

/// Those of meshes that are new: the frame goes on without, or waits.
enum class Curvatures { as_ready, awaited };

struct RenderOptions {
  Transparency transparency = Transparency::weighted_blended;
  TransparencyWeights weights;
  TransparencyWeights surface_weights = weights_of_surfaces;
  /// The scene is drawn with this many pixels a side for each of the output and averaged: 1 while moving, 2
  /// for stills.
  int supersampling = 1;
  Curvatures curvatures = Curvatures::as_ready;
  PointDetail points = PointDetail::as_seen;
};

class Renderer {
 public:
  /// Errors: unsupported for less than OpenGL 3.3; not_found without a font; internal for a shader.
  static Result<std::unique_ptr<Renderer>> create();
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Composes the picture of a slot, in linear light. Errors: invalid_argument for an impossible pinhole;
  /// resource_exhausted when it is too large.
  Status draw_scene(const Frame& frame, const RenderOptions& options, PictureSlot slot = PictureSlot::only);
  /// Shows a composed picture with the frame's overlay in framebuffer `target` (0: the window). Errors:
  /// failed_precondition for a slot without a picture; as above for the overlay of an eye.
  Status present(const Presentation& how, const Overlay& overlay, PictureSlot slot = PictureSlot::only,
                 unsigned target = 0);

  /// Makes a framebuffer black.
  void clear(unsigned target = 0);
  /// A framebuffer of the renderer's own, black: for canvases that nobody sees. Errors: resource_exhausted.
  Result<unsigned> own_canvas(int width_px, int height_px);
  /// What own_canvas() holds.
  Image read_canvas() const;

  /// Waits until all that was drawn is there.
  void finish();

  /// draw_scene() and present() of the whole picture into own_canvas(), waiting until it is there.
  Status draw_offscreen(const Frame& frame, const RenderOptions& options);
  /// The same into memory.
  Result<Image> draw_to_image(const Frame& frame, const RenderOptions& options);

  /// Width of a line of the HUD's text, in multiples of its height.
  float measure_text(std::string_view utf8) const;

 private:
  struct Implementation;
  explicit Renderer(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::client
