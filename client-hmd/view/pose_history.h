#pragma once
// Where something was, is and will be: a ring of measured poses that answers for any time. Between two
// measurements it interpolates (V1: the pose at the shown frame's exposure), after the newest it predicts
// with the formula that the tracking daemon uses (T8), and says which of these it did.

#include <deque>
#include <optional>

#include "client-hmd/view/pinhole.h"
#include "common/base/clock.h"
#include "common/base/motion_prediction.h"

namespace handloft::client {

struct MeasuredPose {
  TimePoint time;
  RigidPose pose;
  glm::dvec3 linear_velocity{0.0};   ///< m/s, world
  glm::dvec3 angular_velocity{0.0};  ///< rad/s, world
};

enum class PoseKind { exact, interpolated, predicted };

struct PoseAnswer {
  RigidPose pose;
  PoseKind kind = PoseKind::exact;
};

struct PoseHistoryOptions {
  std::size_t capacity = 256;                                    ///< Over a second at 200 Hz.
  Duration largest_gap = std::chrono::milliseconds(150);         ///< Wider gaps are not bridged: who knows.
  Duration longest_prediction = std::chrono::milliseconds(250);  ///< After that the pose counts as lost.
  PredictionLimits prediction;
};

class PoseHistory {
 public:
  PoseHistory() = default;
  explicit PoseHistory(PoseHistoryOptions options) : options_(options) {}

  /// False, and nothing is kept, when the time is not after the newest, when anything is not finite or
  /// farther or faster than anything in a room, or when the orientation is not a rotation. A jump back by
  /// more than a second (the daemon started anew) clears the history.
  bool push(const MeasuredPose& sample);

  /// nullopt before the oldest sample, inside a gap, too long after the newest, or when empty.
  std::optional<PoseAnswer> at(TimePoint time) const;

  bool empty() const { return samples_.empty(); }
  /// Of the newest sample; nullopt when empty.
  std::optional<TimePoint> newest() const {
    return samples_.empty() ? std::nullopt : std::optional(samples_.back().time);
  }
  void clear() { samples_.clear(); }

 private:
  PoseHistoryOptions options_;
  std::deque<MeasuredPose> samples_;
};

}  // namespace handloft::client
