// Invariants of the fit over random clouds (A5, A6, A8, A12), with shrinking.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "server-model/geometry/pca_frame.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/polynomial_fitter.h"
#include "server-model/geometry/residual_matching.h"

namespace handloft::geometry {
namespace {

// Conditions with && stand in double parentheses: the macros' decomposition would evaluate both sides.

/// Over the whole range from the first case on: RapidCheck's small first sizes would give coincident points
/// only.
double number(double low, double high) {
  constexpr int steps = 1 << 20;
  const int step = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, steps + 1));
  return low + (high - low) * step / steps;
}

std::vector<WeightedPoint> cloud(std::size_t least) {
  std::vector<WeightedPoint> points(least + *rc::gen::inRange<std::size_t>(0, 60));
  for (WeightedPoint& p : points) {
    p.position = {number(-0.1, 0.1), number(-0.1, 0.1), number(-0.02, 0.02)};
    p.weight = number(0.01, 1);
  }
  return points;
}

double largest(std::span<const double> values) {
  double result = 0;
  for (const double v : values) result = std::max(result, std::abs(v));
  return result;
}

RC_GTEST_PROP(FitProperty, A8_ResidualMatchingIsExact, ()) {
  const int degree = *rc::gen::inRange(1, 5);
  std::vector<WeightedPoint> points = cloud(3 * static_cast<std::size_t>(coefficient_count(degree)));
  const auto fit = fit_polynomial_surface(points, {.degree = degree});
  RC_PRE((fit.ok() && !fit->degree_reduced()));
  std::vector<double> c(fit->surface.scaled_coefficients().size());
  for (double& x : c) x = number(-0.05, 0.05);
  c[0] = 0.05;
  const auto wanted = PolynomialSurface::from_scaled(degree, fit->surface.box(), c);
  match_residuals(*wanted, vertical_residuals(fit->surface, points), points);
  const auto refit = fit_polynomial_surface(points, {.degree = degree});
  RC_ASSERT((refit.ok() && !refit->degree_reduced()));
  for (std::size_t k = 0; k < c.size(); ++k) {
    RC_ASSERT(std::abs(refit->surface.scaled_coefficients()[k] - c[k]) <= 1e-9 * largest(c));
  }
}

RC_GTEST_PROP(FitProperty, A6_NoOtherSurfaceOfTheSpaceFitsBetter, ()) {
  const int degree = *rc::gen::inRange(1, 4);
  const std::vector<WeightedPoint> points = cloud(8);
  const auto fit = fit_polynomial_surface(points, {.degree = degree});
  RC_PRE((fit.ok()));
  std::vector<double> c(fit->surface.scaled_coefficients().begin(), fit->surface.scaled_coefficients().end());
  c[*rc::gen::inRange<std::size_t>(0, c.size())] += number(-0.01, 0.01);
  const auto other = PolynomialSurface::from_scaled(fit->surface.degree(), fit->surface.box(), c);
  RC_ASSERT(residual_statistics(*other, points).weighted_rms >= fit->statistics.weighted_rms * (1 - 1e-12));
}

RC_GTEST_PROP(FitProperty, A5_FrameIsRightHandedAndTurnsWithTheCloud, ()) {
  std::vector<WeightedPoint> points = cloud(4);
  const auto before = pca_frame(points);
  RC_ASSERT(before.ok());
  const Mat3& r = before->frame.rotation;
  RC_ASSERT((r.transpose() * r - Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-12);
  RC_ASSERT(r.col(0).cross(r.col(1)).dot(r.col(2)) > 0.999);
  // Well separated spectra only: near-equal variances turn by error / gap.
  const Vec3& v = before->variance;
  RC_PRE((v[0] - v[1] > 1e-3 * v[0] && v[1] - v[2] > 1e-3 * v[0]));
  const Vec3 axis = Vec3(number(-1, 1), number(-1, 1), 1.5).normalized();
  const Mat3 q = Eigen::AngleAxisd(number(-3, 3), axis).toRotationMatrix();
  for (WeightedPoint& p : points) p.position = q * p.position;
  PcaOptions options;
  options.previous = Frame{q * before->frame.origin, q * r};
  const auto after = pca_frame(points, options);
  RC_ASSERT(after.ok());
  RC_ASSERT((after->frame.rotation - q * r).cwiseAbs().maxCoeff() <= 1e-10);
}

RC_GTEST_PROP(FitProperty, A27_AnyOrderOfAddingAndRemovingIsTheFitOfWhatRemains, ()) {
  const std::vector<WeightedPoint> points = cloud(30);
  PolynomialFitter fitter({.degree = 2});
  std::vector<std::pair<PolynomialFitter::Slot, WeightedPoint>> live;
  for (const WeightedPoint& p : points) {
    live.emplace_back(*fitter.add(p), p);
    if (live.size() > 12 && *rc::gen::inRange(0, 3) == 0) {
      const std::size_t victim = *rc::gen::inRange<std::size_t>(0, live.size());
      RC_ASSERT(fitter.remove(live[victim].first).ok());
      live.erase(live.begin() + static_cast<std::ptrdiff_t>(victim));
    }
  }
  std::vector<WeightedPoint> rest;
  for (const auto& entry : live) rest.push_back(entry.second);
  const auto expected = fit_polynomial_surface(rest);
  const auto found = fitter.solve();
  RC_PRE((expected.ok() && !expected->degree_reduced() && found.ok() && !found->degree_reduced()));
  for (const WeightedPoint& p : rest) {
    const double x = p.position.x();
    const double y = p.position.y();
    RC_ASSERT(std::abs(found->surface.value(x, y) - expected->surface.value(x, y)) <= 1e-9);
  }
}

}  // namespace
}  // namespace handloft::geometry
