#include "server-model/geometry/polynomial_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server-model/geometry/fit_checks.h"

namespace handloft::geometry {
namespace {

/// Points per block: their rows (28 + 1 columns at most) stay in the second-level cache.
constexpr std::size_t block_points = 256;

/// Beyond this a coordinate is no length of anything that a hand shapes, and its square nears overflow.
constexpr double max_coordinate_m = 1e100;

/// A power of two near 1 / largest weight: tiny or huge weights must not underflow or overflow, and scaling
/// by a power of two changes no bit of the solution.
double weight_scale(std::span<const WeightedPoint> points) {
  double largest = 0;
  for (const WeightedPoint& point : points) largest = std::max(largest, point.weight);
  if (largest <= 0) return 1;
  return std::ldexp(1.0, -std::clamp(std::ilogb(largest), -1000, 1000));
}

template <typename PointOf>
Result<PolynomialFit> fit(std::size_t count, const PointOf& local_point, const Box2& box,
                          double weight_factor, const FitOptions& options) {
  const int p = coefficient_count(options.degree);
  RowQr qr(p);
  Eigen::MatrixXd block(block_points, p + 1);
  Eigen::Index used = 0;
  std::size_t weighted_points = 0;
  for (std::size_t i = 0; i < count; ++i) {
    WeightedPoint point = local_point(i);
    if (point.weight == 0) continue;
    point.weight *= weight_factor;
    detail::weighted_row(point, box, options.degree, block.data() + used, block.outerStride());
    ++weighted_points;
    if (++used == block.rows()) {
      qr.append(block);
      used = 0;
    }
  }
  if (used > 0) qr.append(block.topRows(used));
  return detail::solve_for_largest_degree(qr, box, options, weighted_points);
}

}  // namespace

namespace detail {

Status check_fit_options(const FitOptions& options) {
  if (options.degree < min_degree || options.degree > max_degree) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected {}..{}", options.degree, min_degree, max_degree),
                      "degree");
  }
  if (!(options.rank_threshold > 0 && options.rank_threshold < 1)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected between 0 and 1", options.rank_threshold),
                      "rank_threshold");
  }
  return {};
}

Status check_point(const WeightedPoint& point, const std::string& field) {
  if (!(point.position.cwiseAbs().maxCoeff() <= max_coordinate_m) || !point.position.allFinite()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found ({}, {}, {}), expected finite metres", point.position.x(),
                                  point.position.y(), point.position.z()),
                      field + ".position");
  }
  if (!std::isfinite(point.weight) || point.weight < 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected a finite number >= 0", point.weight),
                      field + ".weight");
  }
  return {};
}

Status check_points(std::span<const WeightedPoint> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const WeightedPoint& point = points[i];
    const bool fine = point.position.allFinite() &&
                      point.position.cwiseAbs().maxCoeff() <= max_coordinate_m &&
                      std::isfinite(point.weight) && point.weight >= 0;
    if (!fine) return check_point(point, fmt::format("points[{}]", i));
  }
  return {};
}

Box2 scaling_box(std::span<const WeightedPoint> local_points) {
  Vec2 lower = Vec2::Constant(std::numeric_limits<double>::infinity());
  Vec2 upper = -lower;
  for (const WeightedPoint& point : local_points) {
    lower = lower.cwiseMin(point.position.head<2>());
    upper = upper.cwiseMax(point.position.head<2>());
  }
  if (local_points.empty()) return {Vec2::Zero(), Vec2::Ones()};
  Box2 box{0.5 * (lower + upper), 0.5 * (upper - lower)};
  // A side of no length would divide by zero: any length will do, since the rank says that nothing varies
  // there.
  const double fallback = box.half_extent.maxCoeff() > 0 ? box.half_extent.maxCoeff() : 1.0;
  for (int k = 0; k < 2; ++k) {
    const double noise =
        16 * std::numeric_limits<double>::epsilon() * std::max(std::abs(box.centre[k]), fallback);
    if (box.half_extent[k] <= noise) box.half_extent[k] = fallback;
  }
  return box;
}

void weighted_row(const WeightedPoint& local_point, const Box2& box, int degree, double* row,
                  std::ptrdiff_t stride) {
  std::array<double, max_coefficients> terms;
  const Vec2 uv = (local_point.position.head<2>() - box.centre).cwiseQuotient(box.half_extent);
  evaluate_monomials(degree, uv.x(), uv.y(), terms.data());
  const double root = std::sqrt(local_point.weight);
  const int p = coefficient_count(degree);
  for (int k = 0; k < p; ++k) row[k * stride] = root * terms[static_cast<std::size_t>(k)];
  row[p * stride] = root * local_point.position.z();
}

Result<PolynomialFit> solve_for_largest_degree(const RowQr& qr, const Box2& box, const FitOptions& options,
                                               std::size_t point_count) {
  if (!qr.triangle().allFinite()) {
    return make_error(ErrorCode::invalid_argument, "the coordinates are too large to compute with", "points");
  }
  for (int degree = options.degree; degree >= min_degree; --degree) {
    const int p = coefficient_count(degree);
    if (point_count < static_cast<std::size_t>(p) || qr.rank(p, options.rank_threshold) < p) continue;
    const Eigen::VectorXd c = qr.solve(p);
    Result<PolynomialSurface> surface =
        PolynomialSurface::from_scaled(degree, box, {c.data(), static_cast<std::size_t>(p)});
    if (!surface.ok()) {
      return make_error(ErrorCode::invalid_argument, "the coordinates are too large to compute with",
                        "points");
    }
    PolynomialFit fit;
    fit.surface = *surface;
    fit.requested_degree = options.degree;
    fit.statistics.count = point_count;
    return fit;
  }
  return make_error(
      ErrorCode::rank_deficient,
      point_count < 3
          ? fmt::format("found {} points of weight above 0, expected at least 3 for a plane", point_count)
          : fmt::format("the {} points lie on one line of the base plane (or on one point), expected a "
                        "footprint with an area",
                        point_count),
      "points");
}

}  // namespace detail

Result<PolynomialFit> fit_polynomial_surface(std::span<const WeightedPoint> local_points,
                                             const FitOptions& options) {
  if (Status status = detail::check_fit_options(options); !status.ok()) return status.error();
  if (Status status = detail::check_points(local_points); !status.ok()) return status.error();
  const Box2 box = detail::scaling_box(local_points);
  Result<PolynomialFit> result = fit(
      local_points.size(), [&](std::size_t i) -> const WeightedPoint& { return local_points[i]; }, box,
      weight_scale(local_points), options);
  if (result.ok()) result->statistics = residual_statistics(result->surface, local_points);
  return result;
}

Result<PolynomialFit> fit_polynomial_surface(std::span<const WeightedPoint> world_points, const Frame& frame,
                                             const FitOptions& options) {
  std::vector<WeightedPoint> local(world_points.begin(), world_points.end());
  for (WeightedPoint& point : local) point.position = frame.to_local(point.position);
  return fit_polynomial_surface(local, options);
}

ResidualStatistics residual_statistics(const PolynomialSurface& surface,
                                       std::span<const WeightedPoint> local_points) {
  ResidualStatistics statistics;
  statistics.count = local_points.size();
  if (local_points.empty()) return statistics;
  double sum = 0;
  double weighted_sum = 0;
  double weights = 0;
  for (const WeightedPoint& point : local_points) {
    const double r = point.position.z() - surface.value(point.position.x(), point.position.y());
    sum += r * r;
    weighted_sum += point.weight * (r * r);
    weights += point.weight;
    statistics.max = std::max(statistics.max, std::abs(r));
  }
  statistics.rms = std::sqrt(sum / static_cast<double>(local_points.size()));
  statistics.weighted_rms = weights > 0 ? std::sqrt(weighted_sum / weights) : 0.0;
  return statistics;
}

}  // namespace handloft::geometry
