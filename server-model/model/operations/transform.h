#pragma once
// Similarities x -> scale * R x + shift that keep handedness, and shapes moved by them: points, fit, symmetry
// plane and trim alike, so that nothing needs a fit.

#include <Eigen/Geometry>
#include <cstdint>
#include <string_view>

#include "common/base/result.h"
#include "server-model/geometry/types.h"
#include "server-model/model/document.h"

namespace handloft::model {

struct Similarity {
  double scale = 1;  ///< > 0
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  geometry::Vec3 shift = geometry::Vec3::Zero();

  geometry::Vec3 operator()(const geometry::Vec3& p) const { return scale * (rotation * p) + shift; }
  /// M S M of the mirror M: what a mirror image does when the original does S.
  Similarity mirrored(const geometry::Plane& plane) const;
};

/// Whether the plane in which a shape is mirrored moves with it.
enum class SymmetryPlane : std::uint8_t { stays, goes_along };

/// The shape moved by it, exactly but for rounding: coefficients in the scaled variables keep their bits
/// under rigid motion, and are multiplied by the scale otherwise. Errors: invalid_argument when something
/// would leave the workspace, or the numbers of the surface would leave what double holds.
Result<DualShape> moved(const DualShape& shape, const Similarity& similarity, SymmetryPlane plane,
                        std::string_view field, const Limits& limits);

}  // namespace handloft::model
