#include "client-hmd/view/pose_history.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {
namespace {

// Beyond these it is no measurement: a room is smaller, hands and heads are slower; and what is predicted
// from within them is a number.
constexpr double farthest_m = 1e4;
constexpr double fastest_m_s = 1e3;
constexpr double fastest_rad_s = 1e3;

bool within(const glm::dvec3& v, double limit) {
  return std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;  // NaN is not.
}

bool is_rotation(const glm::dquat& q) {
  constexpr double tolerance = 1e-3;  // Of a float quaternion on the wire, generously.
  const double norm = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return std::isfinite(norm) && std::abs(norm - 1.0) < tolerance;
}

RigidPose predict(const MeasuredPose& from, double ahead_s, const PredictionLimits& limits) {
  const Eigen::Vector3d p(from.pose.position.x, from.pose.position.y, from.pose.position.z);
  const Eigen::Vector3d v(from.linear_velocity.x, from.linear_velocity.y, from.linear_velocity.z);
  const Eigen::Vector3d w(from.angular_velocity.x, from.angular_velocity.y, from.angular_velocity.z);
  const glm::dquat& o = from.pose.orientation;
  const Eigen::Vector3d at = predict_position(p, v, ahead_s, limits);
  const Eigen::Quaterniond turned =
      predict_orientation(Eigen::Quaterniond(o.w, o.x, o.y, o.z), w, ahead_s, limits);
  return {{at.x(), at.y(), at.z()}, {turned.w(), turned.x(), turned.y(), turned.z()}};
}

}  // namespace

bool PoseHistory::push(const MeasuredPose& sample) {
  if (!within(sample.pose.position, farthest_m) || !within(sample.linear_velocity, fastest_m_s) ||
      !within(sample.angular_velocity, fastest_rad_s) || !is_rotation(sample.pose.orientation)) {
    return false;
  }
  if (!samples_.empty()) {
    const Duration step = sample.time - samples_.back().time;
    if (step < -std::chrono::seconds(1)) {
      samples_.clear();
    } else if (step <= Duration::zero()) {
      return false;
    }
  }
  samples_.push_back(sample);
  samples_.back().pose.orientation = glm::normalize(sample.pose.orientation);
  if (samples_.size() > options_.capacity) samples_.pop_front();
  return true;
}

std::optional<PoseAnswer> PoseHistory::at(TimePoint time) const {
  if (samples_.empty()) return std::nullopt;
  const auto after =
      std::lower_bound(samples_.begin(), samples_.end(), time,
                       [](const MeasuredPose& sample, TimePoint t) { return sample.time < t; });
  if (after != samples_.end() && after->time == time) return PoseAnswer{after->pose, PoseKind::exact};
  if (after == samples_.begin()) return std::nullopt;
  const MeasuredPose& before = *(after - 1);
  if (after == samples_.end()) {
    if (time - before.time > options_.longest_prediction) return std::nullopt;
    return PoseAnswer{predict(before, to_seconds(time - before.time), options_.prediction),
                      PoseKind::predicted};
  }
  const Duration gap = after->time - before.time;
  if (gap > options_.largest_gap) return std::nullopt;
  const double share = to_seconds(time - before.time) / to_seconds(gap);
  const RigidPose between{glm::mix(before.pose.position, after->pose.position, share),
                          glm::slerp(before.pose.orientation, after->pose.orientation, share)};
  return PoseAnswer{between, PoseKind::interpolated};
}

}  // namespace handloft::client
