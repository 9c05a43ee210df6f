#include "server-model/geometry/pca_frame.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace handloft::geometry {
namespace {

/// A sum whose error does not depend on the order of its terms to first order (Neumaier), so that permuting
/// the points moves the frame by rounding only.
class CompensatedSum {
 public:
  void add(double term) {
    const double next = sum_ + term;
    correction_ += std::abs(sum_) >= std::abs(term) ? (sum_ - next) + term : (term - next) + sum_;
    sum_ = next;
  }
  double value() const { return sum_ + correction_; }

 private:
  double sum_ = 0;
  double correction_ = 0;
};

Status check_points(std::span<const WeightedPoint> points, PcaWeighting weighting) {
  if (points.empty()) {
    return make_error(ErrorCode::invalid_argument, "found no points, expected at least 1", "points");
  }
  bool any_weight = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].position.allFinite()) {
      return make_error(ErrorCode::invalid_argument, "found a coordinate that is not finite",
                        fmt::format("points[{}].position", i));
    }
    if (weighting == PcaWeighting::by_pressure) {
      const double weight = points[i].weight;
      if (!std::isfinite(weight) || weight < 0) {
        return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected >= 0", weight),
                          fmt::format("points[{}].weight", i));
      }
      any_weight = any_weight || weight > 0;
    }
  }
  if (weighting == PcaWeighting::by_pressure && !any_weight) {
    return make_error(ErrorCode::invalid_argument, "all weights are 0, expected at least one above",
                      "points");
  }
  return {};
}

/// Any unit vector across `axis`: built from the coordinate axis that is farthest from it.
Vec3 any_perpendicular(const Vec3& axis) {
  Vec3::Index smallest = 0;
  axis.cwiseAbs().minCoeff(&smallest);
  return axis.cross(Vec3::Unit(smallest)).cross(axis).normalized();
}

/// The part of `wish` across `axis`, or any perpendicular if nothing is left of it.
Vec3 project_across(const Vec3& wish, const Vec3& axis) {
  const Vec3 projected = wish - wish.dot(axis) * axis;
  constexpr double nearly_parallel = 1e-6;
  return projected.norm() > nearly_parallel ? projected.normalized() : any_perpendicular(axis);
}

/// Turns `axis` so that its largest component is positive.
Vec3 with_positive_largest(const Vec3& axis) {
  Vec3::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  return axis[largest] < 0 ? Vec3(-axis) : axis;
}

Vec3 turned_towards(const Vec3& axis, const Vec3& direction) {
  return axis.dot(direction) < 0 ? Vec3(-axis) : axis;
}

}  // namespace

Result<PcaFrame> pca_frame(std::span<const WeightedPoint> points, const PcaOptions& options) {
  if (Status status = check_points(points, options.weighting); !status.ok()) return status.error();
  if (options.towards_viewer && !options.towards_viewer->allFinite()) {
    return make_error(ErrorCode::invalid_argument, "found a direction that is not finite", "towards_viewer");
  }
  const bool weighted = options.weighting == PcaWeighting::by_pressure;

  // Work relative to the first point and in its scale, so that neither distance nor size costs digits.
  const Vec3 reference = points.front().position;
  double scale = 0;
  for (const WeightedPoint& point : points) {
    scale = std::max(scale, (point.position - reference).cwiseAbs().maxCoeff());
  }
  if (!std::isfinite(scale)) {
    return make_error(ErrorCode::invalid_argument, "the points are too far apart to compute with", "points");
  }
  const double to_unit = scale > std::numeric_limits<double>::min() ? 1.0 / scale : 0.0;

  double largest_weight = 1.0;
  if (weighted) {
    largest_weight = std::max_element(points.begin(), points.end(), [](const auto& a, const auto& b) {
                       return a.weight < b.weight;
                     })->weight;
  }
  const auto weight_of = [&](const WeightedPoint& point) {
    return weighted ? point.weight / largest_weight : 1.0;
  };

  CompensatedSum total;
  std::array<CompensatedSum, 3> first;
  for (const WeightedPoint& point : points) {
    const double weight = weight_of(point);
    total.add(weight);
    for (int k = 0; k < 3; ++k) {
      first[static_cast<std::size_t>(k)].add(weight * (point.position[k] - reference[k]) * to_unit);
    }
  }
  const Vec3 mean = Vec3(first[0].value(), first[1].value(), first[2].value()) / total.value();

  std::array<CompensatedSum, 9> second;
  const auto lower = [](int r, int c) {
    return static_cast<std::size_t>(3) * static_cast<std::size_t>(r) + static_cast<std::size_t>(c);
  };
  for (const WeightedPoint& point : points) {
    const Vec3 d = (point.position - reference) * to_unit - mean;
    const double weight = weight_of(point);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c <= r; ++c) second[lower(r, c)].add(weight * d[r] * d[c]);
    }
  }
  Mat3 covariance;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c <= r; ++c) {
      covariance(r, c) = covariance(c, r) = second[lower(r, c)].value() / total.value();
    }
  }

  const Eigen::SelfAdjointEigenSolver<Mat3> solver(covariance);  // eigenvalues rising
  const Vec3 variance = solver.eigenvalues().reverse().cwiseMax(0.0);
  Vec3 x = solver.eigenvectors().col(2);
  Vec3 z = solver.eigenvectors().col(0);

  // Which axes the spectrum leaves open.
  const double gap = options.degenerate_gap * variance[0];
  const bool xy_equal = variance[0] - variance[1] <= gap;
  const bool yz_equal = variance[1] - variance[2] <= gap;
  const std::optional<Frame>& previous = options.previous;
  const Vec3 wished_x = previous ? previous->x_axis() : Vec3::UnitX();
  const Vec3 wished_z = previous ? previous->normal() : options.towards_viewer.value_or(Vec3::UnitZ());
  if (xy_equal && yz_equal) {  // A ball or a single point: every direction is as good.
    z = wished_z.norm() > 0 ? Vec3(wished_z.normalized()) : Vec3::UnitZ();
    x = project_across(wished_x, z);
  } else if (yz_equal) {  // A line: x is known, z is the wish across it.
    z = project_across(wished_z, x);
  } else if (xy_equal) {  // A disk: z is known.
    x = project_across(wished_x, z);
  }

  // Signs.
  if (previous) {
    x = turned_towards(x, previous->x_axis());
    z = turned_towards(z, previous->normal());
  } else {
    x = with_positive_largest(x);
    z = options.towards_viewer && z.dot(*options.towards_viewer) != 0
            ? turned_towards(z, *options.towards_viewer)
            : with_positive_largest(z);
  }
  z.normalize();
  x = project_across(x, z);

  PcaFrame result;
  result.frame.rotation.col(0) = x;
  result.frame.rotation.col(1) = z.cross(x);
  result.frame.rotation.col(2) = z;
  result.frame.origin = reference + mean * scale;
  result.variance = variance * scale * scale;
  result.degenerate = xy_equal || yz_equal;
  return result;
}

Box2 footprint_box(std::span<const WeightedPoint> points, const Frame& frame) {
  if (points.empty()) return {};
  Vec2 lower = Vec2::Constant(std::numeric_limits<double>::infinity());
  Vec2 upper = -lower;
  for (const WeightedPoint& point : points) {
    const Vec2 xy = frame.to_local(point.position).head<2>();
    lower = lower.cwiseMin(xy);
    upper = upper.cwiseMax(xy);
  }
  return {0.5 * (lower + upper), 0.5 * (upper - lower)};
}

}  // namespace handloft::geometry
