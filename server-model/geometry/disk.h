#pragma once
// The modification disk of a closed hand (A13): its centre is the centroid of the visible fingertips, its
// radius follows the pressure, its normal is the direction of pushing.
//
// The paper averages the "pairwise cross products" of the centroid-to-finger vectors and leaves the order of
// the pairs open, on which the sign depends. Here consecutive fingers are paired, thumb to little and back to
// the thumb, which is Newell's area vector of the fingertips' polygon. Two fingers give no direction (their
// vectors are opposite) and nearly collinear ones only noise: then the last normal is kept. Orientation is
// kept from frame to frame, so that a hand never pushes backwards because one finger was lost.

#include <optional>
#include <span>

#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// The disk at one moment: what it meets it pushes along `normal` (unit length).
struct DiskPose {
  Vec3 centre = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
  double radius_m = 0;
};

struct DiskOptions {
  double min_radius_m = 0.005;  ///< At pressure 0 (A13).
  double max_radius_m = 0.060;  ///< At pressure 1 (A13).
  /// A polygon with less area than this gives no normal: 20 mm^2 lies far below that of any three fingertips
  /// apart (30 mm x 30 mm / 2), and far above the noise of 1 mm over a hand's width.
  double min_area_m2 = 20e-6;
};

/// Half the sum of consecutive cross products: along the polygon's normal, its length the area in m^2.
/// Counter-clockwise seen from the tip of the result. 0 for fewer than three points.
Vec3 newell_area(std::span<const Vec3> polygon);

/// Follows one hand. Not thread-safe.
class ModificationDisk {
 public:
  /// The first normal is turned towards `hint` (the palm's direction, any length) when there is one.
  explicit ModificationDisk(const DiskOptions& options = {}, const std::optional<Vec3>& hint = std::nullopt);

  /// The disk of the visible fingertips, thumb first, little finger last, gaps left out. `pressure` is
  /// clamped to 0..1. nullopt when no finger is visible, a coordinate is not finite, or no normal is known
  /// yet.
  std::optional<DiskPose> update(std::span<const Vec3> fingertips, double pressure);

 private:
  DiskOptions options_;
  std::optional<Vec3> normal_;  // The last one, or the hint.
};

}  // namespace handloft::geometry
