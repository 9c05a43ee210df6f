#include "server-model/geometry/design_block.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "server-model/geometry/fit_checks.h"
#include "server-model/geometry/polynomial_surface.h"

namespace handloft::geometry::detail {

bool ScaledPoints::copy(std::span<const WeightedPoint> local_points) {
  const auto n = static_cast<Eigen::Index>(local_points.size());
  columns_.resize(n, 4);
  weighted_count_ = 0;
  bool good = true;
  for (Eigen::Index i = 0; i < n; ++i) {
    const WeightedPoint& point = local_points[static_cast<std::size_t>(i)];
    good = good && is_good(point);
    columns_(i, 0) = point.position.x();
    columns_(i, 1) = point.position.y();
    columns_(i, 2) = point.position.z();
    columns_(i, 3) = point.weight;
    weighted_count_ += point.weight > 0 ? 1 : 0;
  }
  return good;
}

Result<ScaledPoints> ScaledPoints::from(std::span<const WeightedPoint> local_points) {
  ScaledPoints points;
  if (!points.copy(local_points)) return check_points(local_points).error();
  if (local_points.empty()) {
    points.box_ = usable_box(Box2{Vec2::Zero(), Vec2::Zero()});
    return points;
  }
  // Points of no weight don't pull: if they stretched the box, those that do would lie in a corner of it, and
  // the monomials there hardly differ.
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Vec2 lower = Vec2::Constant(infinity);
  Vec2 upper = -lower;
  for (const WeightedPoint& point : local_points) {
    if (!(point.weight > 0) && points.weighted_count_ > 0) continue;
    lower = lower.cwiseMin(point.position.head<2>());
    upper = upper.cwiseMax(point.position.head<2>());
  }
  points.scale_to(usable_box(Box2{0.5 * (lower + upper), 0.5 * (upper - lower)}));
  return points;
}

ScaledPoints ScaledPoints::in_box(std::span<const WeightedPoint> local_points, const Box2& box) {
  ScaledPoints points;
  points.copy(local_points);
  points.scale_to(box);
  return points;
}

void ScaledPoints::scale_to(const Box2& box) {
  box_ = box;
  for (int axis = 0; axis < 2; ++axis) {
    columns_.col(axis) = (columns_.col(axis) - box.centre[axis]) / box.half_extent[axis];
  }
}

double ScaledPoints::weight_scale() const {
  const double largest = count() > 0 ? columns_.col(3).maxCoeff() : 0.0;
  if (largest <= 0) return 1;
  return std::ldexp(1.0, -std::clamp(std::ilogb(largest), -1000, 1000));
}

DesignBlock::DesignBlock(int degree, const ScaledPoints& points)
    : points_(points),
      degree_(degree),
      rows_(std::min(points.count(), block_points), coefficient_count(degree) + 1) {
  assert(degree >= 0 && degree <= max_degree);
}

void DesignBlock::multiply_up(Eigen::Index begin, Eigen::Index n) {
  // Column 0 holds the constant (or the root of the weight); every other is one of a lower degree times u or
  // v.
  const std::span<const Monomial> terms = monomials(degree_);
  const auto u = points_.u(begin, n);
  const auto v = points_.v(begin, n);
  const auto column = [&](std::size_t k) { return rows_.col(static_cast<Eigen::Index>(k)).head(n).array(); };
  for (std::size_t k = 1; k < terms.size(); ++k) {
    const auto [i, j] = terms[k];
    if (i > 0) {
      column(k) = column(monomial_index(i - 1, j)) * u;
    } else {
      column(k) = column(monomial_index(i, j - 1)) * v;
    }
  }
}

DesignBlock::Rows DesignBlock::weighted(Eigen::Index begin, Eigen::Index n, double weight_factor) {
  assert(n <= capacity());
  auto root = rows_.col(0).head(n).array();
  root = (points_.weight(begin, n) * weight_factor).sqrt();
  rows_.col(rows_.cols() - 1).head(n).array() = root * points_.height(begin, n);
  multiply_up(begin, n);
  return rows_.block(0, 0, n, rows_.cols());
}

DesignBlock::Rows DesignBlock::unweighted(Eigen::Index begin, Eigen::Index n) {
  assert(n <= capacity());
  rows_.col(0).head(n).setOnes();
  rows_.col(rows_.cols() - 1).head(n).array() = points_.height(begin, n);
  multiply_up(begin, n);
  return rows_.block(0, 0, n, rows_.cols());
}

}  // namespace handloft::geometry::detail
