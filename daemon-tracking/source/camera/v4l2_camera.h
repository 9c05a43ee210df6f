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
#include "daemon-tracking/source/camera/camera_source.h"
#include "daemon-tracking/source/camera/v4l2_enumerate.h"
#include "daemon-tracking/source/camera/v4l2_modes.h"
#include "daemon-tracking/source/camera/v4l2_system.h"

namespace handloft::tracking {

/// The mains' frequency, for the camera's own flicker filter.
enum class PowerLine : std::uint8_t { off = 0, hz50 = 1, hz60 = 2 };

/// What is locked, so that colours and exposure stay as they were learned. A value that is left out is locked
/// at what the camera has when it is opened. Numbers are the driver's units where no unit is given.
struct CameraSettings {
  /// At a hand's 444 mm/s (99 of 100 of its speeds), 5 ms are 2.2 mm of blur.
  std::optional<Duration> exposure = std::chrono::milliseconds(5);
  std::optional<int> gain;
  std::optional<int> white_balance_kelvin;
  std::optional<int> focus;
  PowerLine power_line = PowerLine::off;  ///< A fixed exposure needs none, and some cameras bend it to fit.
};

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
  /// While it is absent: how often udev is asked by ourselves, beside look_again().
  Duration retry_interval = std::chrono::milliseconds(250);
};

enum class ExposureState : std::uint8_t {
  unknown,    ///< Not opened yet.
  locked,     ///< Manual, and as asked at the last check.
  drifted,    ///< Something changed it since; it is being set again.
  automatic,  ///< The camera knows no manual exposure, or doesn't keep it.
};

enum class TimestampState : std::uint8_t {
  unknown,
  start_of_exposure,  ///< The driver's own stamps.
  end_of_frame,       ///< The driver's own stamps.
  estimated,          ///< The driver's stamps are of no use: arrival minus the latency learned before.
};

struct CameraHealth {
  bool present = false;
  std::string identity;  ///< identity_of() the camera in use or last used; empty before.
  std::string node;      ///< "/dev/video0"
  std::string model;
  VideoMode mode;  ///< As granted; rate_hz is what G_PARM said.
  double asked_rate_hz = 0;
  double measured_rate_hz = 0;       ///< Of the driver's sequence over the last second; 0 before the first.
  std::uint64_t frames = 0;          ///< Handed on.
  std::uint64_t dropped = 0;         ///< Lost by the driver (gaps in its sequence).
  std::uint64_t drained = 0;         ///< Older ones that were ready together with a newer one.
  std::uint64_t refused = 0;         ///< Flagged as broken, empty, cut off.
  std::uint64_t bad_timestamps = 0;  ///< Stamps that had to be replaced.
  std::uint64_t times_lost = 0;      ///< Unplugged or broken down since start().
  std::uint64_t control_drifts = 0;  ///< Settings found changed by somebody else.
  TimePoint last_frame;              ///< Arrival.
  Duration last_age{};               ///< Arrival minus exposure.
  ExposureState exposure = ExposureState::unknown;
  Duration exposure_time{};  ///< As read back; 0 unknown.
  TimestampState timestamps = TimestampState::unknown;
  std::string problem;  ///< In words, what to do included; empty when all is well.
};

class V4l2Camera : public CameraSource {
 public:
  /// A copy as of now. Any thread.
  virtual CameraHealth health() const = 0;

  /// A device was plugged in or out: an absent camera looks for itself at once. Any thread; quick.
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
