#pragma once
// Two views side by side on any other display (V4), as a headset's calibration says: on its screen, in a
// window for those who build one, or offscreen.

#include "client-hmd/display/display.h"
#include "client-hmd/view/hmd_calibration.h"

namespace handloft::client {

class StereoDisplay final : public Display {
 public:
  StereoDisplay(std::unique_ptr<Display> canvas, HmdCalibration calibration)
      : canvas_(std::move(canvas)), calibration_(std::move(calibration)) {}

  WindowInput poll(OrbitCamera& camera) override { return canvas_->poll(camera); }
  int width_px() const override { return canvas_->width_px(); }
  int height_px() const override { return canvas_->height_px(); }
  std::vector<View> views(int width_px, int height_px) override;
  bool visible() const override { return canvas_->visible(); }
  void show() override { canvas_->show(); }
  std::optional<Duration> refresh_period() const override { return canvas_->refresh_period(); }
  Window* window() override { return canvas_->window(); }
  GraphicsState graphics() override { return canvas_->graphics(); }
  Status renew() override { return canvas_->renew(); }

 private:
  struct Layout {
    int width_px = 0;
    int height_px = 0;
    std::vector<View> views;
  };

  std::unique_ptr<Display> canvas_;
  HmdCalibration calibration_;
  std::vector<Layout> layouts_;  ///< The last sizes: a frame's and a still's.
};

}  // namespace handloft::client
