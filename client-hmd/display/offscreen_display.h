#pragma once
// Pictures that nobody sees until they are saved (V4).

#include "client-hmd/display/display.h"
#include "client-hmd/render/offscreen_context.h"

namespace handloft::client {

class OffscreenDisplay final : public Display {
 public:
  /// Errors: as OffscreenContext::create().
  static Result<std::unique_ptr<Display>> open(int width_px, int height_px);

  WindowInput poll(OrbitCamera& camera) override;
  int width_px() const override { return width_px_; }
  int height_px() const override { return height_px_; }
  std::vector<View> views(int width_px, int height_px) override;
  void show() override {}
  Window* window() override { return nullptr; }
  GraphicsState graphics() override { return graphics_state(); }
  Status renew() override;

 private:
  OffscreenDisplay() = default;

  std::unique_ptr<OffscreenContext> context_;
  int width_px_ = 1;
  int height_px_ = 1;
};

}  // namespace handloft::client
