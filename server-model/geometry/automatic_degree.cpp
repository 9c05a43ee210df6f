#include "server-model/geometry/automatic_degree.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server-model/geometry/fit_checks.h"

namespace handloft::geometry {
namespace {

/// A point with more leverage than this is fitted whatever its height: what the others predict there is noise
/// over 1 - h, which has lost 8 of 16 digits.
constexpr double max_leverage = 1 - 1e-8;

constexpr std::size_t degrees = max_degree;  // Index 0 is degree 1.

/// Sums over the points, one entry a degree.
struct Sums {
  std::array<double, degrees> residual{};         // sum theta r^2
  std::array<double, degrees> cross_validated{};  // sum theta e^2
  std::array<bool, degrees> hangs{};
  /// Of d = theta (e_low^2 - e_high^2): sum d, sum d^2.
  std::array<std::array<double, degrees>, degrees> gain{};
  std::array<std::array<double, degrees>, degrees> gain_squared{};
  double weight = 0;
};

Sums cross_validate(const detail::ScaledPoints& points, const RowQr& qr, int top_degree,
                    double weight_factor) {
  // Q's rows: Q = A R^-1, in place over A's columns from the left.
  const Eigen::Index p = coefficient_count(top_degree);
  const auto r = qr.triangle().topLeftCorner(p, p).triangularView<Eigen::Upper>();
  const Eigen::VectorXd projection = qr.triangle().col(qr.columns()).head(p);
  Sums sums;
  sums.weight = (points.weight(0, points.count()) * weight_factor).sum();
  detail::DesignBlock block(top_degree, points);
  Eigen::ArrayXd leverage(block.capacity());
  Eigen::ArrayXd residual(block.capacity());
  Eigen::ArrayXXd squared(block.capacity(), static_cast<Eigen::Index>(degrees));  // theta e^2
  for (Eigen::Index begin = 0; begin < points.count(); begin += block.capacity()) {
    const Eigen::Index n = std::min(block.capacity(), points.count() - begin);
    auto rows = block.weighted(begin, n, weight_factor);
    auto q = rows.leftCols(p);
    r.solveInPlace<Eigen::OnTheRight>(q);
    auto h = leverage.head(n);
    auto e = residual.head(n);
    h.setZero();
    e = rows.col(p).array();  // sqrt(theta) z
    Eigen::Index column = 0;
    for (int degree = 1; degree <= top_degree; ++degree) {
      for (; column < coefficient_count(degree); ++column) {
        h += q.col(column).array().square();
        e -= projection[column] * q.col(column).array();
      }
      const auto k = static_cast<std::size_t>(degree - 1);
      auto theta_e2 = squared.col(degree - 1).head(n);
      theta_e2 = (e / (1 - h.min(max_leverage))).square();
      sums.residual[k] += e.square().sum();
      sums.cross_validated[k] += theta_e2.sum();
      sums.hangs[k] = sums.hangs[k] || h.maxCoeff() >= max_leverage;
      for (std::size_t low = 0; low < k; ++low) {
        const auto difference = squared.col(static_cast<Eigen::Index>(low)).head(n) - theta_e2;
        sums.gain[low][k] += difference.sum();
        sums.gain_squared[low][k] += difference.square().sum();
      }
    }
  }
  return sums;
}

/// Whether the higher degree predicts significantly better than the lower.
bool betters(const Sums& sums, std::size_t low, std::size_t high, double count, double negligible,
             const AutomaticDegreeOptions& options) {
  const double rms_low = std::sqrt(sums.cross_validated[low] / sums.weight);
  const double rms_high = std::sqrt(sums.cross_validated[high] / sums.weight);
  if (rms_low <= negligible || !(rms_high <= rms_low * (1 - options.least_gain))) return false;
  const double mean = sums.gain[low][high] / count;
  const double variance = std::max(0.0, sums.gain_squared[low][high] / count - mean * mean);
  return mean > options.least_significance * std::sqrt(variance / count);
}

Status check(const AutomaticDegreeOptions& options) {
  if (options.highest_degree < min_degree || options.highest_degree > max_degree) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected {}..{}", options.highest_degree, min_degree, max_degree),
        "highest_degree");
  }
  const auto fraction = [](double value) { return value >= 0 && value < 1; };
  if (!fraction(options.least_gain)) {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0..1", options.least_gain),
                      "least_gain");
  }
  if (!(options.least_significance >= 0 && options.least_significance <= 100)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 0..100 standard errors", options.least_significance),
                      "least_significance");
  }
  if (!fraction(options.negligible_rms)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 0..1", options.negligible_rms), "negligible_rms");
  }
  return detail::check_fit_options(
      {.degree = options.highest_degree, .rank_threshold = options.rank_threshold});
}

}  // namespace

Result<AutomaticFit> fit_automatic_degree(std::span<const WeightedPoint> local_points,
                                          const AutomaticDegreeOptions& options) {
  if (Status status = check(options); !status.ok()) return status.error();
  const Result<detail::ScaledPoints> points = detail::ScaledPoints::from(local_points);
  if (!points.ok()) return points.error();
  FitOptions fit_options{.degree = options.highest_degree, .rank_threshold = options.rank_threshold};
  RowQr qr(coefficient_count(options.highest_degree));
  const double weight_factor = points->weight_scale();
  detail::append_points(*points, options.highest_degree, weight_factor, qr);
  // The largest degree that the points carry; what is singular there is not asked further.
  Result<PolynomialFit> top =
      detail::solve_for_largest_degree(qr, points->box(), fit_options, points->weighted_count());
  if (!top.ok()) return top.error();
  const int top_degree = top->surface.degree();

  AutomaticFit result;
  const Sums sums = cross_validate(*points, qr, top_degree, weight_factor);
  for (int degree = 1; degree <= options.highest_degree; ++degree) {
    DegreeScore score{.degree = degree};
    const auto k = static_cast<std::size_t>(degree - 1);
    const int p = coefficient_count(degree);
    if (degree <= top_degree && qr.rank(p, options.rank_threshold) == p) {
      const bool finite = std::isfinite(sums.cross_validated[k]);
      score.state = sums.hangs[k] || !finite ? DegreeScore::State::hangs_on_single_points
                                             : DegreeScore::State::validated;
      score.weighted_rms = std::sqrt(sums.residual[k] / sums.weight);
      if (score.state == DegreeScore::State::validated) {
        score.cross_validated_rms = std::sqrt(sums.cross_validated[k] / sums.weight);
      }
    }
    result.scores.push_back(score);
  }

  const double negligible = options.negligible_rms * points->box().half_extent.maxCoeff();
  const auto count = static_cast<double>(points->weighted_count());
  std::size_t chosen = 0;
  // Where a plane hangs on single points nothing above it can be validated either.
  for (std::size_t k = 1; k < result.scores.size(); ++k) {
    if (result.scores[k].state == DegreeScore::State::validated &&
        betters(sums, chosen, k, count, negligible, options)) {
      chosen = k;
    }
  }
  fit_options.degree = static_cast<int>(chosen) + 1;
  if (chosen + 1 == static_cast<std::size_t>(options.highest_degree) && !top->degree_reduced()) {
    result.fit = *top;
  } else {
    RowQr lower(coefficient_count(fit_options.degree));
    detail::append_points(*points, fit_options.degree, weight_factor, lower);
    Result<PolynomialFit> fit =
        detail::solve_for_largest_degree(lower, points->box(), fit_options, points->weighted_count());
    if (!fit.ok()) return fit.error();
    result.fit = *fit;
  }
  result.fit.statistics = detail::statistics_of(result.fit.surface, *points);
  result.cross_validated_rms = result.scores[chosen].cross_validated_rms;
  return result;
}

}  // namespace handloft::geometry
