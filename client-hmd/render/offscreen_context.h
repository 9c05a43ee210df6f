#pragma once
// An OpenGL 3.3 core context with no window and no display: EGL on Mesa's surfaceless platform, else the
// default display with a one-pixel pbuffer (V4). Works with software rendering alone.

#include <memory>

#include "common/base/result.h"

namespace handloft::client {

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
