// Spans that are no longer than rounding: CAD files have them (linkrods.step of occt-misc: 5e-12 of the
// range, 24 in a row), and the surface yields all the same.

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "server-model/geometry/sculpt_system.h"
#include "tests/unit/server-model/geometry/sculpt_shapes.h"

namespace handloft::geometry {
namespace {

/// Where ten spans are a thousandth long, K has elements of 1e9 times what bends the rest: rounding.
constexpr double kkt_limit = 1e-8;

/// A flat square of a metre; along v the knots crowd about 0.06, `shortest` apart, each of multiplicity 2.
BSplineSurface crowded(double shortest) {
  std::vector<double> knots{0, 0, 0, 0};
  for (int i = 0; i < 12; ++i) knots.insert(knots.end(), 2, 0.06 + shortest * i);
  knots.insert(knots.end(), {0.3, 0.6, 1, 1, 1, 1});
  BSplineSurface surface{*KnotVector::uniform(3, 8), *KnotVector::open(3, knots), {}, {}};
  for (int i = 0; i < surface.u.control_count(); ++i) {
    for (int j = 0; j < surface.v.control_count(); ++j)
      surface.control.emplace_back(surface.u.greville(i), surface.v.greville(j), 0);
  }
  return surface;
}

double height_under_a_drag(double shortest, double v) {
  const BSplineSurface rest = crowded(shortest);
  auto system = SculptSystem::create(rest, {});
  EXPECT_TRUE(system.ok()) << (system.ok() ? "" : system.error().describe());
  if (!system.ok()) return 0;
  const Vec2 uv(0.5, 0.45);
  const std::vector<SculptRow> rows{
      point_row(rest, uv, PointAspect::position, rest.evaluate(uv.x(), uv.y()) + Vec3(0, 0, 0.02)).value()};
  auto solution = system->solve(rows, {}, ConflictPolicy::refuse);
  EXPECT_TRUE(solution.ok()) << (solution.ok() ? "" : solution.error().describe());
  if (!solution.ok()) return 0;
  const SculptResidual residual = system->residual(rows, {}, *solution);
  EXPECT_LE(residual.stationarity, kkt_limit) << shortest;
  EXPECT_LE(residual.constraints, kkt_limit) << shortest;
  const BSplineSurface moved{rest.u, rest.v, solution->control, {}};
  EXPECT_NEAR(moved.evaluate(uv.x(), uv.y()).z(), 0.02, 1e-12);
  return moved.evaluate(0.5, v).z();
}

TEST(SculptShortSpans, TheSurfaceYieldsAsIfTheyWereALittleLonger) {
  for (const double v : {0.03, 0.2, 0.7}) {
    const double ordinary = height_under_a_drag(1e-3, v);
    EXPECT_GT(ordinary, 0);
    for (const double shortest : {1e-6, 1e-9, 1e-12}) {
      // What crowds is 1 % of the surface; a little of the height is all that may hang on it.
      EXPECT_NEAR(height_under_a_drag(shortest, v), ordinary, 0.05 * 0.02) << shortest << " at " << v;
    }
  }
}

}  // namespace
}  // namespace handloft::geometry
