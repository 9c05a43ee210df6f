#pragma once
// Where a pointing hand draws: at the tip of its index finger.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "proto/operation.pb.h"
#include "server-model/interaction/gesture.h"

namespace handloft::interaction {

/// The index fingertip; nullopt while it is lost. Predicted ones are used: they last 100 ms at most, and a
/// gap would cut a corner instead.
inline std::optional<Eigen::Vector3d> pen_tip(const HandSample& sample) {
  const auto& tip = sample.fingertips[static_cast<std::size_t>(v1::FINGER_INDEX)];
  return tip ? std::optional(tip->position) : std::nullopt;
}

/// Along the points, metres.
inline double length_m(const std::vector<Eigen::Vector3d>& curve) {
  double length = 0;
  for (std::size_t i = 1; i < curve.size(); ++i) length += (curve[i] - curve[i - 1]).norm();
  return length;
}

inline std::vector<Eigen::Vector3d> positions(const google::protobuf::RepeatedPtrField<v1::Point>& points) {
  std::vector<Eigen::Vector3d> result;
  result.reserve(static_cast<std::size_t>(points.size()));
  for (const v1::Point& point : points) {
    result.emplace_back(point.position().x(), point.position().y(), point.position().z());
  }
  return result;
}

}  // namespace handloft::interaction
