// The closest point of random B-spline surfaces, with shrinking: no place of the surface is nearer, a ray
// that is aimed at the surface hits it, and a surface moved by refit() answers as one made anew.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server-model/geometry/bspline_projection.h"

namespace handloft::geometry {
namespace {

/// Over the whole range from the first case on.
double number(double low, double high) {
  constexpr int steps = 1 << 20;
  const int step = *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, steps + 1));
  return low + (high - low) * step / steps;
}

Vec3 place(double extent) {
  const double x = number(-extent, extent), y = number(-extent, extent);
  return {x, y, number(-extent, extent)};
}

KnotVector random_knots() {
  const int degree = *rc::gen::inRange(1, 5);
  const int count = degree + 1 + *rc::gen::inRange(0, 5);
  return *rc::gen::arbitrary<bool>() ? KnotVector::uniform_periodic(degree, count).value()
                                     : KnotVector::uniform(degree, count).value();
}

BSplineSurface random_surface() {
  const KnotVector u = random_knots(), v = random_knots();
  BSplineSurface surface{u, v, {}, {}};
  const bool rational = *rc::gen::arbitrary<bool>();
  for (int k = 0; k < u.control_count() * v.control_count(); ++k) {
    surface.control.push_back(place(1));
    if (rational) surface.weights.push_back(number(0.3, 3));
  }
  return surface;
}

Vec2 parameters(const BSplineSurface& surface) {
  const double u = number(surface.u.lower(), surface.u.upper());
  return {u, number(surface.v.lower(), surface.v.upper())};
}

RC_GTEST_PROP(BSplineProjectionProperty, NoSampleIsNearer, ()) {
  const BSplineSurface surface = random_surface();
  const auto projector = SurfaceProjector::create(surface);
  RC_ASSERT(projector.ok());
  const Vec3 from = place(*rc::gen::element(0.5, 1.0, 10.0));
  const ClosestOnSurface answer = *projector->closest(from);
  RC_ASSERT((surface.evaluate(answer.uv.x(), answer.uv.y()) - answer.place).norm() < 1e-12);
  RC_ASSERT(answer.gap_m < 1e-9);
  // A thousand places at random: a low-discrepancy sequence (R2) from a random start.
  const Vec2 start = parameters(surface);
  const Vec2 low(surface.u.lower(), surface.v.lower()), extent(surface.u.length(), surface.v.length());
  Vec2 part = (start - low).cwiseQuotient(extent);
  for (int k = 0; k < 1000; ++k) {
    part += Vec2(0.7548776662466927, 0.5698402909980532);
    part -= Vec2(std::floor(part.x()), std::floor(part.y()));
    const Vec2 uv = low + extent.cwiseProduct(part);
    RC_ASSERT(answer.distance_m <= (surface.evaluate(uv.x(), uv.y()) - from).norm() + 1e-11);
  }
}

RC_GTEST_PROP(BSplineProjectionProperty, AimedRaysHit, ()) {
  const BSplineSurface surface = random_surface();
  const auto projector = SurfaceProjector::create(surface);
  const Vec2 uv = parameters(surface);
  const Vec3 target = surface.evaluate(uv.x(), uv.y());
  const Vec3 origin = place(3);
  RC_PRE((target - origin).norm() > 1e-3);
  const auto hit = *projector->ray(origin, target - origin);
  RC_ASSERT(hit.has_value());
  RC_ASSERT(hit->distance_m <= (target - origin).norm() + 1e-7);
  RC_ASSERT((origin + hit->distance_m * (target - origin).normalized() - hit->place).norm() < 1e-9);
}

RC_GTEST_PROP(BSplineProjectionProperty, RefitEqualsAnew, ()) {
  BSplineSurface surface = random_surface();
  auto kept = SurfaceProjector::create(surface);
  RC_ASSERT(kept.ok());
  const std::size_t moved = *rc::gen::inRange<std::size_t>(0, surface.control.size());
  surface.control[moved] += place(0.5);
  RC_ASSERT(kept->refit(surface.control).ok());
  const auto fresh = SurfaceProjector::create(surface);
  const Vec3 from = place(2);
  RC_ASSERT(kept->closest(from)->distance_m == fresh->closest(from)->distance_m);
  RC_ASSERT(kept->closest(from, parameters(surface))->distance_m <= fresh->closest(from)->distance_m + 1e-11);
}

}  // namespace
}  // namespace handloft::geometry
