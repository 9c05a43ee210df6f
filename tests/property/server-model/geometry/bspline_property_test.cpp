// Invariants of the operations on B-splines over random surfaces of every kind, with shrinking: what only
// changes the control points leaves the shape where it was, to 1e-12 of its size.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server-model/geometry/bspline_grid.h"
#include "server-model/geometry/bspline_refine.h"
#include "server-model/geometry/bspline_surface.h"

namespace handloft::geometry {
namespace {

/// Over the whole range from the first case on.
double number(double low, double high) {
  constexpr int steps = 1 << 20;
  const int step = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, steps + 1));
  return low + (high - low) * step / steps;
}

/// 0: clamped, 1: unclamped, 2: periodic. Steps that differ up to five times, knots up to p times.
KnotVector random_knots(int degree) {
  const int kind = *rc::gen::inRange(0, 3);
  const int spans = *rc::gen::inRange(2, 6);
  std::vector<double> inner = {number(-1, 1)};
  double at = inner.front();
  for (int s = 1; s <= spans; ++s) {
    at += number(0.2, 1);
    const int times = s == spans ? 1 : *rc::gen::inRange(1, degree + 1);
    inner.insert(inner.end(), static_cast<std::size_t>(times), at);
  }
  std::vector<double> knots;
  if (kind == 2) {
    const long n = static_cast<long>(inner.size()) - 1;
    const double period = inner.back() - inner.front();
    for (long i = -degree; i <= n + degree; ++i) {
      const long k = i >= 0 ? i / n : -((-i + n - 1) / n);
      knots.push_back(inner[static_cast<std::size_t>(i - k * n)] + static_cast<double>(k) * period);
    }
    return KnotVector::periodic(degree, knots).value();
  }
  const double step = kind == 0 ? 0 : 0.3;
  for (int i = degree; i > 0; --i) knots.push_back(inner.front() - step * i);
  knots.insert(knots.end(), inner.begin(), inner.end());
  for (int i = 1; i <= degree; ++i) knots.push_back(inner.back() + step * i);
  return KnotVector::open(degree, knots).value();
}

constexpr double size = 2;

BSplineSurface random_surface() {
  const KnotVector u = random_knots(*rc::gen::inRange(1, 6));
  const KnotVector v = random_knots(*rc::gen::inRange(1, 6));
  BSplineSurface surface{u, v, {}, {}};
  const bool rational = *rc::gen::arbitrary<bool>();
  for (int i = 0; i < u.control_count() * v.control_count(); ++i) {
    surface.control.emplace_back(number(-1, 1), number(-1, 1), number(-1, 1));
    if (rational) surface.weights.push_back(number(0.5, 2));
  }
  return surface;
}

std::vector<double> places(const KnotVector& knots) {
  std::vector<double> us;
  for (int i = 0; i <= 12; ++i) us.push_back(knots.lower() + knots.length() * i / 12);
  return us;
}

/// The largest distance at equal parameters over the domain of `part`.
double difference(const BSplineSurface& part, const BSplineSurface& whole) {
  std::vector<double> us = places(part.u);
  std::vector<double> vs = places(part.v);
  // The end of a part that was cut from a period's end is the next period's start.
  std::vector<Vec3> a, b;
  evaluate_grid(part, us, vs, a);
  evaluate_grid(whole, us, vs, b);
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, (a[i] - b[i]).norm());
  return worst;
}

const KnotVector& along(const BSplineSurface& surface, Direction direction) {
  return direction == Direction::u ? surface.u : surface.v;
}

double somewhere(const KnotVector& knots) {
  return knots.lower() + knots.length() * number(0.001, 0.999);
}

RC_GTEST_PROP(BSplineProperty, RefiningKeepsTheShape, ()) {
  const BSplineSurface first = random_surface();
  RC_ASSERT(check(first).ok());
  BSplineSurface surface = first;
  double tolerance = 1e-12 * size;
  const int operations = *rc::gen::inRange(1, 5);
  for (int k = 0; k < operations; ++k) {
    const Direction direction = *rc::gen::element(Direction::u, Direction::v);
    const KnotVector& knots = along(surface, direction);
    switch (*rc::gen::inRange(0, 4)) {
      case 0: {
        std::vector<double> added(*rc::gen::inRange<std::size_t>(1, 5));
        for (double& knot : added) knot = somewhere(knots);
        auto next = insert_knots(surface, direction, added);
        RC_ASSERT(next.ok());
        surface = *std::move(next);
        break;
      }
      case 1: {
        if (knots.degree() > 6) break;
        auto next = elevate_degree(surface, direction, 1);
        RC_ASSERT(next.ok());
        surface = *std::move(next);
        break;
      }
      case 2:
        surface = clamped(surface);
        break;
      default: {
        // There and back.
        const double knot = somewhere(knots);
        if (knots.multiplicity(knot) > 0) break;
        const auto more = insert_knots(surface, direction, std::vector<double>{knot});
        RC_ASSERT(more.ok());
        auto next = remove_knot(*more, direction, knot, 1e-12 * size);
        if (!next.ok()) {
          // Removal solves from both sides, and with high degrees loses digits; it must say so.
          RC_ASSERT(next.error().code == ErrorCode::failed_precondition);
          break;
        }
        RC_ASSERT(next->control.size() == surface.control.size());
        tolerance = std::max(tolerance, 1e-11 * size);
        surface = *std::move(next);
      }
    }
    RC_ASSERT(check(surface).ok());
    RC_ASSERT(difference(surface, first) <= tolerance);
  }
}

RC_GTEST_PROP(BSplineProperty, PartsAreTheWhole, ()) {
  const BSplineSurface surface = random_surface();
  const Direction direction = *rc::gen::element(Direction::u, Direction::v);
  const auto parts = split(surface, direction, somewhere(along(surface, direction)));
  RC_ASSERT(parts.ok());
  RC_ASSERT(parts->size() == (along(surface, direction).is_periodic() ? 1U : 2U));
  for (const BSplineSurface& part : *parts) RC_ASSERT(difference(part, surface) <= 1e-12 * size);
  for (const BSplineSurface& patch : bezier_patches(surface)) {
    // Inside alone: at a knot where the shape is torn into corners both sides count.
    for (const double s : {0.25, 0.5, 0.75}) {
      const double u = patch.u.lower() + s * patch.u.length();
      const double v = patch.v.lower() + (1 - s) * patch.v.length();
      RC_ASSERT((patch.evaluate(u, v) - surface.evaluate(u, v)).norm() <= 1e-12 * size);
    }
  }
}

RC_GTEST_PROP(BSplineProperty, PlacesStayInTheHullOfTheirControlPoints, ()) {
  const BSplineSurface surface = random_surface();
  std::vector<Vec3> all;
  evaluate_grid(surface, places(surface.u), places(surface.v), all);
  for (const Vec3& place : all) RC_ASSERT(place.cwiseAbs().maxCoeff() <= 1 + 1e-12);
}

RC_GTEST_PROP(BSplineProperty, KnotsOfAnyNumbersAreRefusedOrGood, ()) {
  const auto numbers = *rc::gen::container<std::vector<double>>(rc::gen::arbitrary<double>());
  std::vector<double> knots = numbers;
  if (*rc::gen::arbitrary<bool>()) std::sort(knots.begin(), knots.end());
  const int degree = *rc::gen::inRange(-1, 27);
  for (const auto& made : {KnotVector::open(degree, knots), KnotVector::periodic(degree, knots)}) {
    if (!made.ok()) {
      RC_ASSERT(made.error().code == ErrorCode::invalid_argument);
      continue;
    }
    std::vector<double> values(static_cast<std::size_t>(made->degree() + 1));
    for (const double u : {made->lower(), made->upper(), made->lower() + 0.3 * made->length()}) {
      const double inside = made->wrap(u);
      basis_functions(*made, made->span(inside), inside, 0, values);
      double sum = 0;
      for (const double value : values) sum += value;
      RC_ASSERT(std::abs(sum - 1) <= 1e-9);
    }
  }
}

}  // namespace
}  // namespace handloft::geometry
