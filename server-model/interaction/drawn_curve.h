#pragma once
// A curve drawn in the air made fit to be kept: even along its length, the hand's tremble smoothed away, and
// no more places than its shape needs. Depends on the way that was drawn and not on how often it was looked
// at.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace handloft::interaction {

struct DrawnCurveOptions {
  double spacing_m = 0.003;      ///< Between places before thinning: finer than a hand can steer.
  double smoothing_m = 0.006;    ///< Standard deviation along the curve: a tremble's length at a slow pace.
  double tolerance_m = 0.0005;   ///< Of thinning: a quarter of a tracked fingertip's noise.
  std::size_t max_places = 200;  ///< Before thinning; longer curves are spaced wider.
};

/// The ends stay where they are; a straight line stays straight. Fewer than two different points: as given.
/// `points` must be finite.
std::vector<Eigen::Vector3d> smooth_and_thin(const std::vector<Eigen::Vector3d>& points,
                                             const DrawnCurveOptions& options = {});

}  // namespace handloft::interaction
