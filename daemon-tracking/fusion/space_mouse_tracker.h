#pragma once
// The 3D mouse's six axes as one sample: devices that tell translation and rotation in two reports are told
// on only once both came, so that no mixture of two moments is published. Values -1..1 in world axes as the
// mouse stands before the designer: x right, y away, z up. Pure.

#include <array>
#include <cstdint>
#include <optional>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

struct SpaceMouseLimits {
  double full_scale = 350.0;  ///< Raw value of a cap at its end; more is clamped.
  /// Part of the scale that is nothing: a cap at rest tells up to 10 of 350. What is above begins at 0.
  double dead_zone = 0.03;
  /// A translation whose rotation does not follow is taken alone after this; they come 1 to 8 ms apart.
  Duration pair_within = std::chrono::milliseconds(20);
};

class SpaceMouseTracker {
 public:
  explicit SpaceMouseTracker(const SpaceMouseLimits& limits = {}) : limits_(limits) {}

  /// One report. Errors of the parser leave the state as it was.
  Status consume(const DeviceBytes& bytes);
  /// Lets time pass: half a pair that stays alone is taken.
  void advance(TimePoint time);
  /// Unplugged: the cap is at rest, nothing pressed.
  void device_gone(TimePoint time);

  void describe(FusedSpaceMouse& mouse) const { mouse = state_; }

 private:
  struct Half {
    TimePoint time;
    std::array<std::int16_t, 3> translation{};
  };
  Eigen::Vector3d world(const std::array<std::int16_t, 3>& raw) const;
  void take_alone();
  void stamp(TimePoint time);

  SpaceMouseLimits limits_;
  std::optional<Half> half_;
  FusedSpaceMouse state_;
};

}  // namespace handloft::tracking
