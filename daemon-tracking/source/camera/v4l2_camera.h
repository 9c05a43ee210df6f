#pragma once
// A real camera over V4L2 itself (T1 to T4): its own thread streams through four mapped buffers, drains to
// the newest frame, stamps it with the middle of its exposure and hands the compressed bytes on. It never
// gives up: a camera that is unplugged, refuses, breaks down or is not there yet is reported absent and
// opened again when it comes back. What is wrong stands in words in health().

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "daemon-tracking/source/camera/camera_health.h"
#include "daemon-tracking/source/camera/camera_source.h"
#include "daemon-tracking/source/camera/v4l2_controls.h"
#include "daemon-tracking/source/camera/v4l2_enumerate.h"
#include "daemon-tracking/source/camera/v4l2_modes.h"
#include "daemon-tracking/source/camera/v4l2_system.h"
#include "daemon-tracking/source/hotplug.h"

namespace handloft::tracking {

struct V4l2CameraOptions {
  CameraSelector selector;
  IdentityMismatch mismatch = IdentityMismatch::accept_moved;
  ModeWish mode;
  CameraSettings settings;
  /// Added to a frame's timestamp, from calibration (T4).
  Duration time_offset{};
  /// How long the sensor takes to read a picture out; used when the driver stamps the end of a frame.
  Duration readout{};
  /// Measured below this part of the granted rate for a second: an alarm (T12).
  double slow_rate_part = 0.8;
  /// Tells at once when cameras come and go; must outlive the source's start(). Null: only `retry_interval`.
  HotplugMonitor* hotplug = nullptr;
  /// While it is absent: how often it is looked for beside that.
  Duration retry_interval = std::chrono::milliseconds(250);
};

class V4l2Camera : public CameraSource {
 public:
  /// A copy as of now. Any thread.
  virtual CameraHealth health() const = 0;

  /// A device was plugged in or out: an absent camera looks for itself at once, a present one whether it is
  /// still there. Any thread; quick.
  virtual void look_again() = 0;
};

/// Index and name are the rig's ("camera/left"). `clock` must outlive the source and be CLOCK_MONOTONIC for
/// the kernel's stamps to mean anything. start() succeeds with the camera absent, too: it is opened when it
/// comes. finished() is never true before stop().
std::unique_ptr<V4l2Camera> make_v4l2_camera(std::uint32_t camera, std::string name,
                                             V4l2CameraOptions options, const Clock& clock, Logger log);
/// The same over another system: for tests.
std::unique_ptr<V4l2Camera> make_v4l2_camera(std::uint32_t camera, std::string name,
                                             V4l2CameraOptions options, const Clock& clock, Logger log,
                                             std::shared_ptr<V4l2System> system);

}  // namespace handloft::tracking
