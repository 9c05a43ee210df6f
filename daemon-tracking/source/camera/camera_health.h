#pragma once
// How a camera does, for people and for metrics (T12, T15): counts, rates and what is wrong in words.

#include <cstdint>
#include <string>

#include "common/base/clock.h"
#include "daemon-tracking/source/camera/v4l2_controls.h"
#include "daemon-tracking/source/camera/v4l2_modes.h"

namespace handloft::tracking {

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
  double measured_rate_hz = 0;       ///< Buffers the driver filled, over the last second; 0 before it.
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

}  // namespace handloft::tracking
