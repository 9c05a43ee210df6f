// Fitting curves to rows of points, and curves in parameters by length.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "server-model/geometry/bspline_fit.h"
#include "server-model/geometry/bspline_fit_detail.h"
#include "server-model/geometry/bspline_refine.h"
#include "server-model/geometry/gauss_rule.h"

namespace handloft::geometry {
namespace {

using detail::Rows;

Rows to_rows(std::span<const Vec3> points) {
  Rows rows(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  return rows;
}

BSplineCurve to_curve(const KnotVector& knots, const Rows& control) {
  BSplineCurve curve{knots, {}, {}};
  for (Eigen::Index i = 0; i < control.rows(); ++i) curve.control.emplace_back(control.row(i).transpose());
  return curve;
}

enum class Measure { nearest_place, same_parameter };

/// How far the points lie from the curve, and the worst of each span where it is above the tolerance.
FitError measured(const BSplineCurve& curve, std::span<const Vec3> points, std::span<const double> parameters,
                  Measure measure, double tolerance_m, std::vector<double>& wanted) {
  FitError error;
  double squares = 0;
  wanted.assign(static_cast<std::size_t>(curve.knots.function_count()), 0.0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    double u = parameters[i];
    const double distance = measure == Measure::nearest_place ? detail::distance_near(curve, points[i], u)
                                                              : (curve.evaluate(u) - points[i]).norm();
    error.max_m = std::max(error.max_m, distance);
    squares += distance * distance;
    double& span = wanted[static_cast<std::size_t>(curve.knots.span(parameters[i]))];
    if (distance > tolerance_m) span = std::max(span, distance);
  }
  error.rms_m = std::sqrt(squares / static_cast<double>(points.size()));
  return error;
}

/// From the knots given on, more where the error is.
Result<CurveFit> refine_until_near(std::span<const Vec3> points, std::span<const double> parameters,
                                   KnotVector knots, Measure measure, const BSplineFitOptions& options) {
  const Rows data = to_rows(points);
  std::optional<CurveFit> best;
  for (;;) {
    const Result<Rows> control = detail::approximate_rows(knots, parameters, data);
    if (!control) return best ? Result<CurveFit>(*std::move(best)) : control.error();
    CurveFit fit{to_curve(knots, *control), {}, false};
    std::vector<double> wanted;
    fit.error = measured(fit.curve, points, parameters, measure, options.tolerance_m, wanted);
    fit.within_tolerance = fit.error.max_m <= options.tolerance_m;
    if (!best || fit.error.max_m < best->error.max_m) best = std::move(fit);
    if (best->within_tolerance) break;
    const std::vector<double> inner =
        detail::halved_inner_knots(knots, parameters, wanted, options.max_control_points);
    if (inner.empty()) break;
    Result<KnotVector> next = detail::clamped_knots(knots.degree(), knots.lower(), knots.upper(), inner);
    if (!next) break;
    knots = *std::move(next);
  }
  return *std::move(best);
}

/// Places along a curve and the lengths up to them.
struct Samples {
  std::vector<Vec3> places;
  std::vector<double> lengths;
  std::vector<std::size_t> knot_at;  ///< Which sample each span starts with.
};

Samples sampled(const BSplineCurve& curve, int per_span) {
  constexpr int gauss_points = 8;
  const GaussRule rule = gauss_rule(gauss_points);
  Samples samples;
  samples.places.push_back(curve.evaluate(curve.knots.lower()));
  samples.lengths.push_back(0);
  for (const int s : curve.knots.spans()) {
    const double low = curve.knots.knots()[static_cast<std::size_t>(s)];
    const double high = curve.knots.knots()[static_cast<std::size_t>(s) + 1];
    samples.knot_at.push_back(samples.places.size() - 1);
    for (int k = 1; k <= per_span; ++k) {
      const double a = low + (high - low) * (k - 1) / per_span;
      const double b = k == per_span ? high : low + (high - low) * k / per_span;
      double length = 0;
      for (std::size_t g = 0; g < rule.node.size(); ++g) {
        const double u = a + (b - a) * (rule.node[g] + 1) / 2;
        length += rule.weight[g] * (b - a) / 2 * curve.derivatives(u, 1)[1].norm();
      }
      samples.lengths.push_back(samples.lengths.back() + length);
      samples.places.push_back(curve.evaluate(b));
    }
  }
  return samples;
}

}  // namespace

Result<std::vector<double>> chord_parameters(std::span<const Vec3> points) {
  if (points.size() < 2) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected at least 2", points.size()), "points");
  }
  if (const Status status = detail::check_points(points, "points"); !status) return status.error();
  std::vector<double> parameters = {0};
  for (std::size_t i = 1; i < points.size(); ++i) {
    parameters.push_back(parameters.back() + (points[i] - points[i - 1]).stableNorm());
  }
  const double length = parameters.back();
  if (!(length > 0)) {
    return make_error(ErrorCode::invalid_argument, "found points that are all the same", "points");
  }
  for (double& parameter : parameters) parameter /= length;
  parameters.back() = 1;
  return parameters;
}

Result<BSplineCurve> interpolate_curve(std::span<const Vec3> points, int degree) {
  if (degree < 1 || degree > KnotVector::max_degree) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1..{}", degree, KnotVector::max_degree), "degree");
  }
  if (const Status status = detail::check_points(points, "points"); !status) return status.error();
  std::vector<Vec3> apart(points.begin(), points.end());
  apart.erase(std::unique(apart.begin(), apart.end()), apart.end());
  if (apart.size() <= static_cast<std::size_t>(degree)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {} points that differ, expected at least {}", apart.size(), degree + 1), "points");
  }
  const Result<std::vector<double>> parameters = chord_parameters(apart);
  if (!parameters) return parameters.error();
  const Result<KnotVector> knots = detail::averaged_knots(*parameters, degree);
  if (!knots) return knots.error();
  const Result<Rows> control = detail::interpolate_rows(*knots, *parameters, to_rows(apart));
  if (!control) return control.error();
  return to_curve(*knots, *control);
}

Result<CurveFit> approximate_curve(std::span<const Vec3> points, const BSplineFitOptions& options) {
  const Result<std::vector<double>> parameters = chord_parameters(points);
  if (!parameters) return parameters.error();
  return approximate_curve(points, *parameters, options);
}

Result<CurveFit> approximate_curve(std::span<const Vec3> points, std::span<const double> parameters,
                                   const BSplineFitOptions& options) {
  if (const Status status = detail::check_options(options); !status) return status.error();
  if (const Status status = detail::check_points(points, "points"); !status) return status.error();
  const int least = options.degree_u + 1;
  if (points.size() < static_cast<std::size_t>(least) || options.max_control_points < least) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} points and room for {} control points, expected at least {}",
                                  points.size(), options.max_control_points, least),
                      "points");
  }
  if (parameters.size() != points.size()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} for {} points", parameters.size(), points.size()), "parameters");
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!std::isfinite(parameters[i]) || (i > 0 && parameters[i] < parameters[i - 1])) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected ascending ones", parameters[i]),
                        fmt::format("parameters[{}]", i));
    }
  }
  Result<KnotVector> knots =
      detail::clamped_knots(options.degree_u, parameters.front(), parameters.back(), {});
  if (!knots) return knots.error();
  return refine_until_near(points, parameters, *std::move(knots), Measure::nearest_place, options);
}

Result<CurveFit> by_length(const BSplineCurve& curve, const BSplineFitOptions& options) {
  if (const Status status = check(curve); !status) return status.error();
  if (const Status status = detail::check_options(options); !status) return status.error();
  const BSplineCurve open = clamped(curve);
  constexpr int first_samples = 16, last_samples = 256, more = 4;
  std::optional<CurveFit> best;
  for (int per_span = first_samples; per_span <= last_samples; per_span *= more) {
    const Samples samples = sampled(open, per_span);
    const double length = samples.lengths.back();
    const double size = open.control.front().norm() + length;
    if (!(length > 1e-12 * size)) {
      return make_error(ErrorCode::invalid_argument, fmt::format("found a length of {} m", length), "curve");
    }
    // A knot keeps its continuity.
    const int degree = std::max(options.degree_u, open.knots.degree());
    std::vector<double> inner;
    const std::vector<int> spans = open.knots.spans();
    for (std::size_t k = 1; k < spans.size(); ++k) {
      const double knot = open.knots.knots()[static_cast<std::size_t>(spans[k])];
      const int times = open.knots.multiplicity(knot) + degree - open.knots.degree();
      inner.insert(inner.end(), static_cast<std::size_t>(std::min(times, degree)),
                   samples.lengths[samples.knot_at[k]]);
    }
    Result<KnotVector> knots = detail::clamped_knots(degree, 0, length, inner);
    if (!knots) return knots.error();
    // Every other sample is fitted, the rest watches between them.
    std::vector<Vec3> places;
    std::vector<double> lengths;
    for (std::size_t i = 0; i < samples.places.size(); i += 2) {
      places.push_back(samples.places[i]);
      lengths.push_back(samples.lengths[i]);
    }
    Result<CurveFit> fit = refine_until_near(places, lengths, *knots, Measure::same_parameter, options);
    if (!fit) return best ? Result<CurveFit>(*std::move(best)) : fit;
    std::vector<double> wanted;
    fit->error = measured(fit->curve, samples.places, samples.lengths, Measure::same_parameter,
                          options.tolerance_m, wanted);
    fit->within_tolerance = fit->error.max_m <= options.tolerance_m;
    if (!best || fit->error.max_m < best->error.max_m) best = *std::move(fit);
    if (best->within_tolerance) break;
  }
  return *std::move(best);
}

}  // namespace handloft::geometry
