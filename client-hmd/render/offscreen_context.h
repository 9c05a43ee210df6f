#pragma once
// An OpenGL 3.3 core context with no window and no display: EGL on a graphics card, else on Mesa's
// surfaceless platform (LIBGL_ALWAYS_SOFTWARE=1: that one), else the default display with a one-pixel pbuffer
// (V4). Works with software rendering alone.

#include <memory>

#include "common/base/result.h"

namespace handloft::client {

/// Whether what is drawn can still be seen.
enum class GraphicsState {
  good,
  lost,  ///< The driver was reset: everything that was on the card is gone, and the context with it.
};

/// Of the current context; contexts that are not told of resets are always good.
GraphicsState graphics_state();

class OffscreenContext {
 public:
  /// Creates the context and makes it current on the calling thread. Errors: unsupported, saying which step
  /// EGL refused.
  static Result<std::unique_ptr<OffscreenContext>> create();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

 private:
  OffscreenContext() = default;
  void* display_ = nullptr;
  void* context_ = nullptr;
  void* surface_ = nullptr;
};

}  // namespace handloft::client
