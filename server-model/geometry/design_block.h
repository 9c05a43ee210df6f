#pragma once
// Points laid out for fitting: one array each for u, v (scaled to the box), height and weight, so that the
// processor works on several points at once; and the design matrix of eq. 3 made from them, in blocks of rows
// that stay in the cache. Shared by the functions that fit; not for others.

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry::detail {

/// Rows per block: 256 rows of 28 + 1 columns at most are 59 KB and stay in the second-level cache.
inline constexpr Eigen::Index block_points = 256;

class ScaledPoints {
 public:
  /// Checks, copies and scales to the footprint's box: that of the points of weight above 0, or of all when
  /// none has one. Errors: as check_points() says.
  static Result<ScaledPoints> from(std::span<const WeightedPoint> local_points);
  /// The same with a box that is given. Precondition: half extents > 0, points that pass check_points().
  static ScaledPoints in_box(std::span<const WeightedPoint> local_points, const Box2& box);

  Eigen::Index count() const { return columns_.rows(); }
  const Box2& box() const { return box_; }
  /// How many have a weight above 0.
  std::size_t weighted_count() const { return weighted_count_; }
  /// A power of two near 1 / largest weight: tiny or huge weights must not underflow or overflow, and scaling
  /// by a power of two changes no bit of the solution.
  double weight_scale() const;

  auto u(Eigen::Index begin, Eigen::Index n) const { return columns_.col(0).segment(begin, n); }
  auto v(Eigen::Index begin, Eigen::Index n) const { return columns_.col(1).segment(begin, n); }
  auto height(Eigen::Index begin, Eigen::Index n) const { return columns_.col(2).segment(begin, n); }
  auto weight(Eigen::Index begin, Eigen::Index n) const { return columns_.col(3).segment(begin, n); }

 private:
  /// False if a point is not good.
  bool copy(std::span<const WeightedPoint> local_points);
  void scale_to(const Box2& box);

  Box2 box_;
  Eigen::ArrayX4d columns_;  ///< u, v, height, weight.
  std::size_t weighted_count_ = 0;
};

class DesignBlock {
 public:
  using Rows = Eigen::Block<Eigen::MatrixXd, Eigen::Dynamic, Eigen::Dynamic>;

  /// For surfaces of `degree` (0..6); room for min(points.count(), block_points) rows. `points` must outlive
  /// it.
  DesignBlock(int degree, const ScaledPoints& points);

  Eigen::Index capacity() const { return rows_.rows(); }
  /// sqrt(theta * weight_factor) * (monomials | z) of n <= capacity() points, that may be overwritten.
  Rows weighted(Eigen::Index begin, Eigen::Index n, double weight_factor);
  /// (monomials | z).
  Rows unweighted(Eigen::Index begin, Eigen::Index n);

 private:
  void multiply_up(Eigen::Index begin, Eigen::Index n);

  const ScaledPoints& points_;
  int degree_;
  Eigen::MatrixXd rows_;
};

}  // namespace handloft::geometry::detail
