#include "server-model/geometry/design_block.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "server-model/geometry/fit_checks.h"
#include "server-model/geometry/polynomial_surface.h"

namespace handloft::geometry::detail {

Result<ScaledPoints> ScaledPoints::from(std::span<const WeightedPoint> local_points) {
  const auto n = static_cast<Eigen::Index>(local_points.size());
  ScaledPoints points;
  points.u_.resize(n);
  points.v_.resize(n);
  points.height_.resize(n);
  points.weight_.resize(n);
  bool good = true;
  for (Eigen::Index i = 0; i < n; ++i) {
    const WeightedPoint& point = local_points[static_cast<std::size_t>(i)];
    good = good && is_good(point);
    points.u_[i] = point.position.x();
    points.v_[i] = point.position.y();
    points.height_[i] = point.position.z();
    points.weight_[i] = point.weight;
  }
  if (!good) return check_points(local_points).error();
  if (n == 0) {
    points.box_ = usable_box(Box2{Vec2::Zero(), Vec2::Zero()});
    return points;
  }
  const Vec2 lower(points.u_.minCoeff(), points.v_.minCoeff());
  const Vec2 upper(points.u_.maxCoeff(), points.v_.maxCoeff());
  points.scale_to(usable_box(Box2{0.5 * (lower + upper), 0.5 * (upper - lower)}));
  return points;
}

ScaledPoints ScaledPoints::in_box(std::span<const WeightedPoint> local_points, const Box2& box) {
  const auto n = static_cast<Eigen::Index>(local_points.size());
  ScaledPoints points;
  points.u_.resize(n);
  points.v_.resize(n);
  points.height_.resize(n);
  points.weight_.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const WeightedPoint& point = local_points[static_cast<std::size_t>(i)];
    points.u_[i] = point.position.x();
    points.v_[i] = point.position.y();
    points.height_[i] = point.position.z();
    points.weight_[i] = point.weight;
  }
  points.scale_to(box);
  return points;
}

void ScaledPoints::scale_to(const Box2& box) {
  box_ = box;
  u_ = (u_ - box.centre.x()) / box.half_extent.x();
  v_ = (v_ - box.centre.y()) / box.half_extent.y();
}

std::size_t ScaledPoints::weighted_count() const {
  return static_cast<std::size_t>((weight_ > 0).count());
}

double ScaledPoints::weight_scale() const {
  const double largest = weight_.size() > 0 ? weight_.maxCoeff() : 0.0;
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
