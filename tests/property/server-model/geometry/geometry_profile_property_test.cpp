// Invariants of profile modification over random clouds and strokes (A8, A18 - A21), with shrinking.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/profile_modification.h"
#include "server-model/geometry/resample.h"
#include "server-model/geometry/residual_matching.h"

namespace handloft::geometry {
namespace {

// Conditions with && stand in double parentheses: the macros' decomposition would evaluate both sides.

/// Over the whole range from the first case on.
double number(double low, double high) {
  constexpr int steps = 1 << 20;
  const int step = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, steps + 1));
  return low + (high - low) * step / steps;
}

/// 7 points and more, theta in (0, 1]: from a few points to thousands, each decade as likely.
std::vector<WeightedPoint> cloud() {
  const double decades = number(0, 3);
  std::vector<WeightedPoint> points(static_cast<std::size_t>(7 * std::pow(10.0, decades)));
  // Too many for a generator each: a seed generates them.
  std::uint64_t state = static_cast<std::uint64_t>(*rc::gen::inRange(1, 1 << 30));
  const auto unit = [&] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 11U) / 9007199254740992.0;
  };
  for (WeightedPoint& p : points) {
    p.position = {0.2 * unit() - 0.1, 0.2 * unit() - 0.1, 0.04 * unit() - 0.02};
    p.weight = 1.0 - 0.99 * unit();
  }
  return points;
}

std::vector<Curve> strokes() {
  std::vector<Curve> result(*rc::gen::inRange<std::size_t>(1, 4));
  for (Curve& curve : result) {
    curve.resize(*rc::gen::inRange<std::size_t>(1, 20));
    for (Vec3& p : curve) p = {number(-0.15, 0.15), number(-0.15, 0.15), number(0.02, 0.1)};
  }
  return result;
}

/// Whether the points determine degree N well enough to speak of 1e-9: eps times the condition number.
bool well_posed(const std::vector<WeightedPoint>& points, int degree) {
  const auto fit = fit_polynomial_surface(points, {.degree = degree, .rank_threshold = 1e-5});
  return fit.ok() && !fit->degree_reduced();
}

RC_GTEST_PROP(ProfileProperty, A8_A19_RefitGivesTheSurfaceOfTheCurves, ()) {
  const int wanted = *rc::gen::inRange(1, 5);
  std::vector<WeightedPoint> points = cloud();
  const auto before = fit_polynomial_surface(points, {.degree = wanted});
  RC_PRE(before.ok());
  const int degree = before->surface.degree();
  RC_PRE(well_posed(points, degree));
  const auto fitter = ProfileFitter::create(points, before->surface);
  RC_ASSERT(fitter.ok());
  const auto after = fitter->fit_with(*points_along(*prepare_strokes(strokes()), points.size()));
  RC_ASSERT(after.ok());
  RC_ASSERT(after->degree() == degree);
  match_residuals(*after, vertical_residuals(before->surface, points), points);
  const auto refit = fit_polynomial_surface(points, {.degree = degree});
  RC_ASSERT((refit.ok() && !refit->degree_reduced()));
  double largest = 0;
  double off = 0;
  for (std::size_t k = 0; k < after->scaled_coefficients().size(); ++k) {
    largest = std::max(largest, std::abs(after->scaled_coefficients()[k]));
    off = std::max(off, std::abs(refit->surface.scaled_coefficients()[k] - after->scaled_coefficients()[k]));
  }
  RC_ASSERT(off <= 1e-9 * largest);
}

RC_GTEST_PROP(ProfileProperty, A19_OrderAndDirectionChangeNoBit, ()) {
  std::vector<Curve> drawn = strokes();
  const std::size_t total = *rc::gen::inRange<std::size_t>(1, 300);
  const auto points = points_along(*prepare_strokes(drawn), total);
  RC_ASSERT((points.ok() && points->size() == total));
  const int turn = *rc::gen::inRange(0, 3);
  std::rotate(drawn.begin(), drawn.begin() + turn % static_cast<int>(drawn.size()), drawn.end());
  for (Curve& curve : drawn) {
    if (*rc::gen::arbitrary<bool>()) std::reverse(curve.begin(), curve.end());
  }
  RC_ASSERT(*points_along(*prepare_strokes(drawn), total) == *points);
}

RC_GTEST_PROP(ProfileProperty, A21_PartsMakeTheWhole, ()) {
  const Curve stroke = strokes().front();
  std::vector<double> fractions(*rc::gen::inRange<std::size_t>(0, 6));
  for (double& f : fractions) f = number(0, 1);
  std::sort(fractions.begin(), fractions.end());
  const auto parts = split_curve(stroke, fractions);
  RC_ASSERT((parts.ok() && parts->size() == fractions.size() + 1));
  double length = 0;
  for (std::size_t k = 0; k < parts->size(); ++k) {
    RC_ASSERT(!(*parts)[k].empty());
    if (k > 0) RC_ASSERT((*parts)[k].front() == (*parts)[k - 1].back());
    length += curve_length((*parts)[k]);
  }
  RC_ASSERT(std::abs(length - curve_length(stroke)) <= 1e-12);
  RC_ASSERT(parts->front().front() == stroke.front());
  RC_ASSERT(parts->back().back() == stroke.back());
}

}  // namespace
}  // namespace handloft::geometry
