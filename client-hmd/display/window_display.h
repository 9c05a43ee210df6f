#pragma once
// One picture in a window, for people without a headset (V4, V6).

#include "client-hmd/display/display.h"

namespace handloft::client {

class WindowDisplay final : public Display {
 public:
  /// Errors: as Window::open().
  static Result<std::unique_ptr<Display>> open(int width_px, int height_px);

  WindowInput poll(OrbitCamera& camera) override { return window_->poll(camera); }
  int width_px() const override { return window_->width_px(); }
  int height_px() const override { return window_->height_px(); }
  std::vector<View> views() const override;
  void show() override { window_->swap(); }
  Window* window() override { return window_.get(); }

 private:
  WindowDisplay() = default;

  std::unique_ptr<Window> window_;
};

}  // namespace handloft::client
