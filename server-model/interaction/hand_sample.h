#pragma once
// What the interaction needs of one hand in one tracking frame, checked: every number finite, every state one
// that we know (T14). The frame comes over a socket, so a bad value is an error with a name, never a point.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "proto/tracking.pb.h"

namespace handloft::interaction {

inline constexpr std::size_t finger_count = 5;

/// A fingertip that may be used: tracked, seen by one camera, or predicted (T6, T8).
struct Fingertip {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, metres
  bool seen = false;  ///< By a camera within the last 100 ms, not only predicted.
};

struct HandSample {
  TimePoint capture_time;
  std::array<std::optional<Fingertip>, finger_count>
      fingertips;  ///< In the order of v1::Finger; nullopt: lost.
  v1::Gesture gesture = v1::GESTURE_UNKNOWN;
  /// When that gesture began, before debouncing; no later than the frame. nullopt: not told.
  std::optional<TimePoint> gesture_since;
  double pressure = 0.0;  ///< rho, 0..1 (A1)
  bool pressing = false;
  bool thumb_laid = false;     ///< The thumb's pad is closed: a tap divides a profile stroke (A21).
  double potentiometer = 0.0;  ///< 0..1: the propagation's range (A16), a moved shape's size, an exponent.
};

struct SampleLimits {
  double max_distance_m = 10.0;  ///< A fingertip farther than this from the table is a fault, not a hand.
};

/// Checks hand `index` of `frame`; nullopt when the frame has no such hand. Errors: invalid_argument naming
/// the field
/// ("hands[0].fingertips[2].position.x").
Result<std::optional<HandSample>> read_hand(const v1::TrackingFrame& frame, int index,
                                            const SampleLimits& limits = {});

}  // namespace handloft::interaction
