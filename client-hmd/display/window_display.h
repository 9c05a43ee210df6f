#pragma once
// A picture in a window, for people without a headset (V4, V6), or over the whole of a chosen monitor.

#include "client-hmd/desktop/window.h"
#include "client-hmd/display/display.h"
#include "client-hmd/display/monitor_choice.h"
#include "common/base/log.h"

namespace handloft::client {

struct WindowDisplayOptions {
  int width_px = 1280;  ///< Of the window, when it covers no monitor.
  int height_px = 720;
  std::optional<std::string> monitor;  ///< Name or number to cover, borderless; none: a window.
};

/// Of this machine, in the order in which they are numbered from 0. Errors: unsupported without a display
/// server.
Result<std::vector<MonitorInfo>> list_monitors();

class WindowDisplay final : public Display {
 public:
  /// Errors: as Window::open(). A monitor that is not there is waited for, in a window.
  static Result<std::unique_ptr<Display>> open(const WindowDisplayOptions& options, Logger log);

  WindowInput poll(OrbitCamera& camera) override;
  int width_px() const override { return window_->width_px(); }
  int height_px() const override { return window_->height_px(); }
  std::vector<View> views(int width_px, int height_px) override;
  bool visible() const override;
  void show() override { window_->swap(); }
  std::optional<Duration> refresh_period() const override;
  Window* window() override { return window_.get(); }
  GraphicsState graphics() override { return graphics_state(); }
  Status renew() override;

 private:
  WindowDisplay(WindowDisplayOptions options, Logger log);
  void follow_monitors();
  const std::vector<MonitorInfo>& monitors() const;
  void place(const Placement& placement);

  WindowDisplayOptions options_;
  Logger log_;
  MonitorChoice choice_;
  SystemClock clock_;
  /// Asking the display server takes round trips: as they were a moment ago.
  mutable std::vector<MonitorInfo> monitors_;
  mutable std::optional<TimePoint> monitors_at_;
  std::unique_ptr<Window> window_;
};

}  // namespace handloft::client
