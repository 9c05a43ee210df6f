#pragma once
// Similarities x -> scale * R x + shift that keep handedness: how entities are moved, and what has moved one
// so far, so that what is pinned to it goes along (U6).

#include <Eigen/Geometry>
#include <memory>

#include "server-model/geometry/types.h"

namespace handloft::model {

struct Similarity {
  double scale = 1;  ///< > 0
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  geometry::Vec3 shift = geometry::Vec3::Zero();

  geometry::Vec3 operator()(const geometry::Vec3& p) const { return scale * (rotation * p) + shift; }
  /// M S M of the mirror M: what a mirror image does when the original does S.
  Similarity mirrored(const geometry::Plane& plane) const;
  /// This one after the other.
  Similarity after(const Similarity& other) const;
  Similarity inverse() const;
  bool finite() const;

  /// Bit by bit.
  bool operator==(const Similarity& other) const;
};

/// Null is none at all.
bool same_motion(const std::shared_ptr<const Similarity>& a, const std::shared_ptr<const Similarity>& b);

}  // namespace handloft::model
