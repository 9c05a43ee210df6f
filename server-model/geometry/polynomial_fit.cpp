#include "server-model/geometry/polynomial_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server-model/geometry/design_block.h"
#include "server-model/geometry/fit_checks.h"

namespace handloft::geometry {
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
    if (!is_good(point)) return check_point(point, fmt::format("points[{}]", i));
  }
  return {};
}

double extent_noise(const Box2& box, int axis) {
  const double largest = box.half_extent.maxCoeff() > 0 ? box.half_extent.maxCoeff() : 1.0;
  return 16 * std::numeric_limits<double>::epsilon() * std::max(std::abs(box.centre[axis]), largest);
}

Box2 usable_box(const Box2& footprint) {
  // A side of no length would divide by zero: any length will do, since the rank says that nothing varies
  // there.
  Box2 box = footprint;
  const double fallback = footprint.half_extent.maxCoeff() > 0 ? footprint.half_extent.maxCoeff() : 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    if (box.half_extent[axis] <= extent_noise(footprint, axis)) box.half_extent[axis] = fallback;
  }
  return box;
}

void append_points(const ScaledPoints& points, int degree, double weight_factor, RowQr& qr) {
  DesignBlock block(degree, points);
  for (Eigen::Index begin = 0; begin < points.count(); begin += block.capacity()) {
    qr.append(block.weighted(begin, std::min(block.capacity(), points.count() - begin), weight_factor));
  }
}

ResidualStatistics statistics_of(const PolynomialSurface& surface, const ScaledPoints& points) {
  ResidualStatistics statistics;
  statistics.count = static_cast<std::size_t>(points.count());
  if (points.count() == 0) return statistics;
  double sum = 0;
  double weighted_sum = 0;
  double weights = 0;
  const auto coefficients = surface.scaled_coefficients();
  const Eigen::Map<const Eigen::VectorXd> c(coefficients.data(),
                                            static_cast<Eigen::Index>(coefficients.size()));
  DesignBlock block(surface.degree(), points);
  Eigen::VectorXd residuals(block.capacity());
  for (Eigen::Index begin = 0; begin < points.count(); begin += block.capacity()) {
    const Eigen::Index n = std::min(block.capacity(), points.count() - begin);
    const auto rows = block.unweighted(begin, n);
    auto r = residuals.head(n);
    r = rows.rightCols<1>();
    r.noalias() -= rows.leftCols(c.size()) * c;
    statistics.max = std::max(statistics.max, r.lpNorm<Eigen::Infinity>());
    r.array() *= r.array();
    sum += r.sum();
    weighted_sum += (points.weight(begin, n) * r.array()).sum();
    weights += points.weight(begin, n).sum();
  }
  statistics.rms = std::sqrt(sum / static_cast<double>(points.count()));
  statistics.weighted_rms = weights > 0 ? std::sqrt(weighted_sum / weights) : 0.0;
  return statistics;
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
  const Result<detail::ScaledPoints> points = detail::ScaledPoints::from(local_points);
  if (!points.ok()) return points.error();
  RowQr qr(coefficient_count(options.degree));
  detail::append_points(*points, options.degree, points->weight_scale(), qr);
  Result<PolynomialFit> result =
      detail::solve_for_largest_degree(qr, points->box(), options, points->weighted_count());
  if (result.ok()) result->statistics = detail::statistics_of(result->surface, *points);
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
  return detail::statistics_of(surface, detail::ScaledPoints::in_box(local_points, surface.box()));
}

}  // namespace handloft::geometry
