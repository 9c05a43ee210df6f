#pragma once
// The last pass: averages the samples of a pixel, turns the picture to the display time, bends it for the
// lens channel by channel, encodes it as sRGB. What no lens shows is black.

#include "client-hmd/render/gl.h"
#include "client-hmd/render/presentation.h"

namespace handloft::client {

/// What is shown.
struct FinishedPicture {
  GLuint colour = 0;        ///< Linear.
  glm::vec2 size_px{1.0F};  ///< In pixels of the output.
  int samples = 1;          ///< A side, for each of them.
  GLuint overlay = 0;       ///< sRGB, premultiplied, of the size of what is shown; 0: none.
};

class PresentPass {
 public:
  static Result<PresentPass> create();

  /// Into the bound framebuffer.
  void draw(const FinishedPicture& picture, const Presentation& how);

 private:
  void upload(const std::shared_ptr<const LensMesh>& lens);

  GlProgram program_;
  GlVertexArray no_vertices_;
  GlProgram lens_program_;
  GlVertexArray lens_array_;
  GlBuffer lens_vertices_;
  GlBuffer lens_indices_;
  std::shared_ptr<const LensMesh> uploaded_;
};

}  // namespace handloft::client
