// Constraints and loads on a sculpted surface: every kind of row is met, and nothing else is (D4 to D16).

#include "server-model/geometry/sculpt_system.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>

#include "server-model/geometry/sculpt_spring.h"
#include "tests/unit/server-model/geometry/sculpt_shapes.h"

namespace handloft::geometry {
namespace {

constexpr double kkt_limit = 1e-10;

SculptSystem make(const BSplineSurface& rest, const SculptSetup& setup = {}) {
  Result<SculptSystem> system = SculptSystem::create(rest, setup);
  EXPECT_TRUE(system.ok()) << system.error().describe();
  return std::move(*system);
}

SculptSetup free_edges() {
  SculptSetup setup;
  setup.supports = {Support::free, Support::free, Support::free, Support::free};
  return setup;
}

SculptSolution solved(SculptSystem& system, const std::vector<SculptRow>& rows,
                      const std::vector<SculptLoad>& loads = {}) {
  Result<SculptSolution> solution = system.solve(rows, loads, ConflictPolicy::refuse);
  EXPECT_TRUE(solution.ok()) << solution.error().describe();
  const SculptResidual residual = system.residual(rows, loads, *solution);
  EXPECT_LE(residual.stationarity, kkt_limit);
  EXPECT_LE(residual.constraints, kkt_limit);
  return std::move(*solution);
}

SculptRow drag(const BSplineSurface& rest, const Vec2& uv, const Vec3& by) {
  return point_row(rest, uv, PointAspect::position, rest.evaluate(uv.x(), uv.y()) + by).value();
}

TEST(SculptSystem, RestShapeStaysWithoutLoads) {  // D4
  const BSplineSurface rest = curved_surface();
  for (const SculptSetup& setup : {SculptSetup{}, free_edges()}) {
    SculptSystem system = make(rest, setup);
    EXPECT_TRUE(same_bits(solved(system, {}).control, rest.control));
    std::vector<SculptRow> rows;
    for (const Vec2& uv : {Vec2(0.3, 0.4), Vec2(1.2, 1.9), Vec2(1.7, 0.8)})
      rows.push_back(drag(rest, uv, Vec3::Zero()));
    rows.push_back(point_row(rest, {1, 1}, PointAspect::tangent_u, rest.derivatives(1, 1, 1).su).value());
    EXPECT_LE(largest_difference(solved(system, rows).control, rest.control), 1e-12);
  }
}

TEST(SculptSystem, MeetsEveryAspectOfAPoint) {  // D6, D7
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest);
  const Vec2 uv(0.83, 1.21);
  const SurfaceDerivatives d = rest.derivatives(uv.x(), uv.y(), 2);
  const auto aspect_of = [](const SurfaceDerivatives& at, PointAspect aspect) -> Vec3 {
    switch (aspect) {
      case PointAspect::position:
        return at.s;
      case PointAspect::tangent_u:
        return at.su;
      case PointAspect::tangent_v:
        return at.sv;
      case PointAspect::second_u:
        return at.suu;
      case PointAspect::second_v:
        return at.svv;
      case PointAspect::twist:
        return at.suv;
    }
    return Vec3::Zero();
  };
  std::vector<SculptRow> together;
  for (const PointAspect aspect : {PointAspect::position, PointAspect::tangent_u, PointAspect::tangent_v,
                                   PointAspect::second_u, PointAspect::second_v, PointAspect::twist}) {
    const Vec3 target = aspect_of(d, aspect) + Vec3(0.03, -0.02, 0.11);
    const SculptRow row = point_row(rest, uv, aspect, target).value();
    const BSplineSurface bent = with_control(rest, solved(system, {row}).control);
    EXPECT_LE((aspect_of(bent.derivatives(uv.x(), uv.y(), 2), aspect) - target).norm(), 1e-10)
        << static_cast<int>(aspect);
    together.push_back(row);
  }
  const BSplineSurface bent = with_control(rest, solved(system, together).control);
  for (const PointAspect aspect : {PointAspect::position, PointAspect::second_u, PointAspect::twist})
    EXPECT_LE((aspect_of(bent.derivatives(uv.x(), uv.y(), 2), aspect) - aspect_of(d, aspect) -
               Vec3(0.03, -0.02, 0.11))
                  .norm(),
              1e-10);
}

TEST(SculptSystem, TurnsTheNormal) {  // D8
  const BSplineSurface rest = curved_surface();
  for (const SculptSetup& setup : {SculptSetup{}, free_edges()}) {
    SculptSystem system = make(rest, setup);
    const Vec3 normal = Vec3(0.3, -0.4, 0.9).normalized();
    std::vector<SculptRow> rows;
    append(rows, normal_rows(rest, {1.2, 0.6}, normal).value());
    rows.push_back(drag(rest, {1.2, 0.6}, Vec3(0, 0, 0.05)));
    rows.push_back(drag(rest, {0.2, 1.6}, Vec3::Zero()));
    const BSplineSurface bent = with_control(rest, solved(system, rows).control);
    const SurfaceDerivatives d = bent.derivatives(1.2, 0.6, 1);
    EXPECT_LE(std::abs(normal.dot(d.su)), 1e-10);
    EXPECT_LE(std::abs(normal.dot(d.sv)), 1e-10);
    EXPECT_GT(bent.normal(1.2, 0.6).dot(normal), 1 - 1e-9) << "not turned over";
    EXPECT_LE((d.s - rest.evaluate(1.2, 0.6) - Vec3(0, 0, 0.05)).norm(), 1e-10);
  }
}

TEST(SculptSystem, HeldSidesStayToTheBit) {
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest);
  const SculptSolution solution = solved(system, {drag(rest, {1, 1}, Vec3(0.1, 0.2, 0.3))});
  const int nu = rest.u.control_count();
  const int nv = rest.v.control_count();
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const bool held = i < 2 || i >= nu - 2 || j < 2 || j >= nv - 2;
      EXPECT_EQ(held, solution.control[rest.index(i, j)] == rest.at(i, j)) << i << ' ' << j;
    }
}

TEST(SculptSystem, ReactionsAreTheForcesThatLoadsWouldNeed) {
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest);
  const SculptSolution held = solved(system, {drag(rest, {0.7, 1.1}, Vec3(0.01, -0.02, 0.06))});
  const SculptLoad load = point_load(rest, {0.7, 1.1}, held.reactions[0]).value();
  EXPECT_LE(largest_difference(solved(system, {}, {load}).control, held.control), 1e-12);
}

TEST(SculptSystem,
     BodyMovesWhereNothingHoldsItButRows) {  // Free edges: three rows moved alike move all alike.
  const BSplineSurface rest = curved_surface();
  for (const double membrane : {0.05, 0.0}) {
    SculptSetup setup = free_edges();
    setup.energy.a11 = setup.energy.a22 = membrane;
    SculptSystem system = make(rest, setup);
    const Vec3 by(0.3, -0.1, 0.2);
    const std::vector<SculptRow> rows{drag(rest, {0.1, 0.2}, by), drag(rest, {1.8, 0.5}, by),
                                      drag(rest, {0.9, 1.7}, by)};
    const SculptSolution solution = solved(system, rows);
    for (std::size_t i = 0; i < rest.control.size(); ++i)
      EXPECT_LE((solution.control[i] - rest.control[i] - by).norm(), 1e-12);
    // One row alone: it moves no farther than the row demands.
    const SculptSolution by_one = solved(system, {rows[0]});
    EXPECT_LE(by_one.displacement.norm(), solution.displacement.norm() * (1 + 1e-12));
    EXPECT_EQ(by_one.displacement.norm() < 0.99 * solution.displacement.norm(), membrane == 0)
        << "a plate tilts about its far end, a membrane does not";
  }
}

TEST(SculptSystem, PlateOnThreePointsTiltsWithoutBending) {  // Without membrane, free edges
  const BSplineSurface rest = flat_surface(3, 9, 9);
  SculptSetup setup = free_edges();
  setup.energy.a11 = setup.energy.a22 = 0;
  SculptSystem system = make(rest, setup);
  const SculptSolution solution =
      solved(system, {drag(rest, {0, 0}, Vec3::Zero()), drag(rest, {1, 0}, Vec3(0, 0, 0.1)),
                      drag(rest, {0, 1}, Vec3(0, 0, -0.2))});
  for (std::size_t i = 0; i < rest.control.size(); ++i)
    EXPECT_NEAR(solution.control[i].z(), 0.1 * rest.control[i].x() - 0.2 * rest.control[i].y(), 1e-11);
}

TEST(SculptSystem,
     TiesOfFreeSurfacesHaveNoEffect) {  // The answer is the limit of soft springs, without them.
  const BSplineSurface rest = flat_surface(3, 12, 10);
  SculptSetup setup = free_edges();
  SculptSystem system = make(rest, setup);
  const std::vector<SculptRow> rows{drag(rest, {0.2, 0.3}, Vec3(0, 0, 0.1)),
                                    drag(rest, {0.8, 0.6}, Vec3::Zero())};
  const std::vector<SculptLoad> loads{point_load(rest, {0.9, 0.1}, Vec3(0, 0.01, 0.02)).value()};
  const SculptSolution solution = solved(system, rows, loads);
  // The same by dense algebra: [K C^T; C 0].
  const Eigen::MatrixXd k = stiffness(rest.u, rest.v, setup.energy);
  const Eigen::Index n = k.rows();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n + 2, n + 2);
  all.topLeftCorner(n, n) = k;
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + 2, 3);
  for (Eigen::Index r = 0; r < 2; ++r) {
    const SculptRow& row = rows[static_cast<std::size_t>(r)];
    for (std::size_t i = 0; i < row.functional.point.size(); ++i)
      all(n + r, row.functional.point[i]) = all(row.functional.point[i], n + r) = row.functional.value[i];
    right.row(n + r) = (r == 0 ? Vec3(0, 0, 0.1) : Vec3(0, 0, 0)).transpose();
  }
  for (std::size_t i = 0; i < loads[0].functional.point.size(); ++i)
    right.row(loads[0].functional.point[i]) = loads[0].functional.value[i] * loads[0].force.transpose();
  const Eigen::MatrixXd dense = all.fullPivLu().solve(right);
  for (Eigen::Index i = 0; i < n; ++i)
    EXPECT_LE((solution.control[static_cast<std::size_t>(i)] - rest.control[static_cast<std::size_t>(i)] -
               dense.row(i).transpose())
                  .norm(),
              1e-10);
}

TEST(SculptSystem, LoadsThatNothingBearsAreRefused) {
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest, free_edges());
  const std::vector<SculptLoad> push{point_load(rest, {1, 1}, Vec3::UnitZ()).value()};
  const Result<SculptSolution> loose = system.solve({}, push, ConflictPolicy::refuse);
  ASSERT_FALSE(loose.ok());
  EXPECT_EQ(loose.error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(loose.error().field, "supports");
  // Balanced loads need no support; a derivative's row bears no force, a position's does.
  const std::vector<SculptLoad> pair{push[0], point_load(rest, {0.3, 0.4}, -Vec3::UnitZ()).value()};
  EXPECT_TRUE(system.solve({}, pair, ConflictPolicy::refuse).ok());
  const SculptRow tangent =
      point_row(rest, {1, 1}, PointAspect::tangent_u, rest.derivatives(1, 1, 1).su).value();
  EXPECT_FALSE(system.solve(std::vector{tangent}, push, ConflictPolicy::refuse).ok());
  EXPECT_TRUE(
      system.solve(std::vector{drag(rest, {0.3, 0.4}, Vec3::Zero())}, push, ConflictPolicy::refuse).ok());
}

TEST(SculptSystem, BitsDoNotDependOnWhatWasAskedBefore) {
  const BSplineSurface rest = curved_surface();
  for (const SculptSetup& setup : {SculptSetup{}, free_edges()}) {
    std::vector<SculptRow> rows;
    for (int i = 0; i < 7; ++i)
      rows.push_back(drag(rest, {0.25 * i + 0.1, 1.9 - 0.23 * i}, Vec3(0.01 * i, 0.02, -0.01 * i)));
    rows.push_back(normal_rows(rest, {0.5, 0.5}, Vec3(0.1, 0, 1)).value()[0]);
    const std::vector<SculptLoad> loads{point_load(rest, {1.1, 0.9}, Vec3(1, 2, 3)).value()};
    SculptSystem fresh = make(rest, setup);
    const SculptSolution at_once = solved(fresh, rows, loads);
    SculptSystem used = make(rest, setup);
    for (std::size_t i = rows.size(); i-- > 0;) {  // One after the other, the last first.
      const Result<SculptSolution> one = used.solve(std::vector{rows[i]}, {}, ConflictPolicy::least_squares);
      ASSERT_TRUE(one.ok());
    }
    std::vector<SculptRow> moved = rows;
    for (SculptRow& row : moved) row.target += Vec3(0.1, 0.1, 0.1);
    (void)solved(used, moved, loads);
    EXPECT_TRUE(same_bits(solved(used, rows, loads).control, at_once.control));
    EXPECT_EQ(used.solved(), rows.size() + loads.size()) << "each functional once";
  }
}

TEST(SculptSystem, CurveConstraintAlongAParameterLineIsExact) {  // D9
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest, free_edges());
  const std::vector<Vec2> line{{0.77, 0.0}, {0.77, 2.0}};
  const std::vector<CurvePlace> places = collocation_places(rest, line).value();
  EXPECT_EQ(places.size(), 6u * 4u + 2u) << "4 places in each of 6 spans, and the ends";
  // Any curve of the surface's own kind along v: each row of control points moved as a whole.
  BSplineSurface aim = rest;
  for (int i = 0; i < rest.u.control_count(); ++i)
    for (int j = 0; j < rest.v.control_count(); ++j)
      aim.control[aim.index(i, j)] += Vec3(0.02 * j, 0.01 * std::sin(3.0 * j), 0.05 * std::cos(2.0 * j));
  std::vector<Vec3> targets;
  for (const CurvePlace& place : places) targets.push_back(aim.evaluate(place.uv.x(), place.uv.y()));
  const std::vector<SculptRow> rows = curve_rows(rest, places, targets, 0).value();
  const SculptSolution solution = solved(system, rows);
  EXPECT_EQ(solution.dependent.size(), places.size() - static_cast<std::size_t>(rest.v.control_count()))
      << "more places than the curve has control points";
  const BSplineSurface bent = with_control(rest, solution.control);
  for (double v = 0; v <= 2; v += 0.01)
    EXPECT_LE((bent.evaluate(0.77, v) - aim.evaluate(0.77, v)).norm(), 1e-9) << v;
}

TEST(SculptSystem, CurveConstraintHoldsBetweenItsPlaces) {  // D9: <= 1e-4 of the diagonal
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest);
  const std::vector<Vec2> line{{0.4, 0.5}, {1.0, 1.4}, {1.6, 1.3}};
  const std::vector<CurvePlace> places = collocation_places(rest, line).value();
  const auto lifted = [&](const Vec2& uv, double t) -> Vec3 {
    return rest.evaluate(uv.x(), uv.y()) + 0.06 * std::sin(std::numbers::pi * t) * Vec3(0.2, 0, 1);
  };
  std::vector<Vec3> targets;
  for (const CurvePlace& place : places) targets.push_back(lifted(place.uv, place.t));
  const double allowed = 1e-4 * extent(rest);
  const std::vector<SculptRow> rows = curve_rows(rest, places, targets, allowed).value();
  const Result<SculptSolution> solution = system.solve(rows, {}, ConflictPolicy::refuse);
  ASSERT_TRUE(solution.ok()) << solution.error().describe();
  const BSplineSurface bent = with_control(rest, solution->control);
  const double first = (line[1] - line[0]).norm();
  const double length = first + (line[2] - line[1]).norm();
  double largest = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double s = i / 1000.0 * length;
    const Vec2 uv = s < first ? Vec2(line[0] + s / first * (line[1] - line[0]))
                              : Vec2(line[1] + (s - first) / (length - first) * (line[2] - line[1]));
    largest = std::max(largest, (bent.evaluate(uv.x(), uv.y()) - lifted(uv, s / length)).norm());
  }
  EXPECT_LE(largest, allowed);
}

TEST(SculptSystem, RegionMovesAsABodyAndTheRestFollows) {  // D11
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest);
  const UvRectangle region{{0.6, 0.7}, {1.1, 1.3}};  // On knots.
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.translate(Vec3(0.02, 0.01, 0.08)).rotate(Eigen::AngleAxisd(0.2, Vec3(1, 2, 0).normalized()));
  const BSplineSurface bent =
      with_control(rest, solved(system, region_rows(rest, region, motion).value()).control);
  for (double u = 0.6; u <= 1.1; u += 0.05)
    for (double v = 0.7; v <= 1.3; v += 0.05)
      EXPECT_LE((bent.evaluate(u, v) - motion * rest.evaluate(u, v)).norm(), 1e-9);
  EXPECT_GT((bent.evaluate(0.35, 1.0) - rest.evaluate(0.35, 1.0)).norm(), 1e-3)
      << "outside is free to follow";
  EXPECT_EQ((bent.evaluate(0, 1.0) - rest.evaluate(0, 1.0)).norm(), 0);
}

TEST(SculptSystem, InsideOfARegionDeformsAndTheRestStays) {  // D11, figure 7: interior deformation
  const BSplineSurface rest = curved_surface();
  SculptSetup setup = free_edges();
  const UvRectangle region{{0.2, 0.0}, {1.8, 1.5}};
  setup.held = points_outside(rest, region).value();
  SculptSystem system = make(rest, setup);
  const BSplineSurface bent =
      with_control(rest, solved(system, {drag(rest, {1.0, 0.8}, Vec3(0, 0, 0.1))}).control);
  EXPECT_LE((bent.evaluate(1.0, 0.8) - rest.evaluate(1.0, 0.8) - Vec3(0, 0, 0.1)).norm(), 1e-10);
  for (double s = 0; s <= 2; s += 0.1) {
    EXPECT_EQ((bent.evaluate(0.15, s) - rest.evaluate(0.15, s)).norm(), 0);
    EXPECT_EQ((bent.evaluate(1.85, s) - rest.evaluate(1.85, s)).norm(), 0);
    EXPECT_EQ((bent.evaluate(s, 1.6) - rest.evaluate(s, 1.6)).norm(), 0);
  }
}

TEST(SculptSystem, LineLoadOfATranslationPushesLikeItsForce) {  // D10: f = k (c - c') along the line
  const BSplineSurface rest = flat_surface(3, 13, 13);
  const std::vector<CurvePlace> places =
      line_quadrature(rest, std::vector<Vec2>{{0.2, 0.5}, {0.8, 0.5}}).value();
  double length = 0;
  for (const CurvePlace& place : places) length += place.weight_m;
  EXPECT_NEAR(length, 0.6, 1e-12);
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.translation() = Vec3(0, 0, 0.1);
  const std::vector<SculptLoad> loads = motion_loads(rest, places, motion, 50).value();
  Vec3 force = Vec3::Zero();
  for (std::size_t i = 0; i < loads[0].functional.point.size(); ++i)
    force += loads[0].functional.value[i] * loads[0].force;
  EXPECT_LE((force - Vec3(0, 0, 5)).norm(), 1e-12);
  SculptSystem system = make(rest);
  const BSplineSurface bent = with_control(rest, solved(system, {}, loads).control);
  EXPECT_GT(bent.evaluate(0.5, 0.5).z(), 0);
  EXPECT_NEAR(bent.evaluate(0.3, 0.5).z(), bent.evaluate(0.7, 0.5).z(), 1e-12);
  // Turned about its middle: the ends go opposite ways.
  motion = Eigen::AngleAxisd(0.1, Vec3::UnitY());
  motion.pretranslate(Vec3(0.5, 0.5, 0) - motion * Vec3(0.5, 0.5, 0));
  const BSplineSurface turned =
      with_control(rest, solved(system, {}, motion_loads(rest, places, motion, 50).value()).control);
  EXPECT_LT(turned.evaluate(0.7, 0.5).z(), 0);
  EXPECT_NEAR(turned.evaluate(0.3, 0.5).z(), -turned.evaluate(0.7, 0.5).z(), 1e-12);
}

TEST(SculptSystem, AreaQuadratureMeasuresTheRegion) {  // D12
  const BSplineSurface rest = flat_surface(3, 9, 11);
  double area = 0;
  const std::vector<CurvePlace> places = area_quadrature(rest, {{0.1, 0.3}, {0.7, 0.9}}).value();
  for (const CurvePlace& place : places) area += place.weight_m;
  EXPECT_NEAR(area, 0.36, 1e-12);
}

TEST(SculptSystem, SpringsOfMatchingStiffnessFollowTheHand) {  // D16: closed form, ratio 1, any dx
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest);
  const Vec2 uv(0.9, 1.3);
  const std::vector<SculptRow> rows{drag(rest, {0.5, 0.8}, Vec3::Zero()),
                                    normal_rows(rest, {1.3, 1.2}, rest.normal(1.3, 1.2)).value()[0]};
  const Vec3 direction = Vec3(0.2, -0.3, 1).normalized();
  const double g = system.compliance(rows, std::vector{point_load(rest, uv, direction).value()}).value();
  const double k = matching_stiffness(g).value();
  for (const double dx : {1e-6, 1e-2, 1.0}) {
    const SculptSolution bent = solved(system, rows, {point_load(rest, uv, k * dx * direction).value()});
    const SculptSolution still = solved(system, rows);
    const double dy = (with_control(rest, bent.control).evaluate(uv.x(), uv.y()) -
                       with_control(rest, still.control).evaluate(uv.x(), uv.y()))
                          .dot(direction);
    EXPECT_NEAR(dy / dx, 1, 1e-9) << dx;
  }
  // Where a constraint holds the place there is nothing to match.
  const std::vector<SculptLoad> on_row{point_load(rest, {0.5, 0.8}, direction).value()};
  EXPECT_FALSE(matching_stiffness(system.compliance(rows, on_row).value()).ok());
}

TEST(SculptSystem, PapersLoopReachesItsRange) {  // D16: within 3 iterations from k0 * 1e+-6
  const BSplineSurface rest = curved_surface();
  SculptSystem system = make(rest);
  const double g =
      system.compliance({}, std::vector{point_load(rest, {0.9, 1.3}, Vec3::UnitZ()).value()}).value();
  for (const double off : {1e-6, 1.0, 1e6}) {
    const auto ratio = [&](double k) -> Result<double> {
      const double dx = 0.02;
      const SculptSolution bent =
          solved(system, {}, {point_load(rest, {0.9, 1.3}, Vec3(0, 0, k * dx)).value()});
      return (with_control(rest, bent.control).evaluate(0.9, 1.3) - rest.evaluate(0.9, 1.3)).z() / dx;
    };
    const AdaptedStiffness found = adapt_stiffness(off / g, ratio).value();
    EXPECT_LE(found.iterations, 3);
    EXPECT_GE(found.ratio, 0.8);
    EXPECT_LE(found.ratio, 1.2);
  }
  EXPECT_FALSE(adapt_stiffness(1, [](double) -> Result<double> { return 0.0; }).ok());
  EXPECT_FALSE(adapt_stiffness(1, [](double) -> Result<double> { return 3.0; }).ok())
      << "one that never adapts";
  EXPECT_FALSE(adapt_stiffness(0, [](double) -> Result<double> { return 1.0; }).ok());
  EXPECT_FALSE(adapt_stiffness(std::nan(""), [](double) -> Result<double> { return 1.0; }).ok());
}

TEST(SculptSystem, MomentsTurnTheTangentPlane) {  // D15: torsion as a couple on derivatives
  const BSplineSurface rest = flat_surface(3, 13, 13);
  SculptSystem system = make(rest);
  for (const Vec3& axis : {Vec3::UnitX().eval(), Vec3::UnitY().eval(), Vec3::UnitZ().eval()}) {
    const std::array<SculptLoad, 2> unit = moment_loads(rest, {0.5, 0.5}, axis).value();
    const double g = system.compliance({}, unit).value();
    const double angle = 0.01;
    const std::array<SculptLoad, 2> turn =
        moment_loads(rest, {0.5, 0.5}, matching_stiffness(g).value() * angle * axis).value();
    const SculptSolution bent = solved(system, {}, {turn[0], turn[1]});
    const SurfaceDerivatives d = with_control(rest, bent.control).derivatives(0.5, 0.5, 1);
    // To first order each tangent turns by angle x tangent; about z only on the mean of both.
    const Vec3 du = d.su - Vec3::UnitX();
    const Vec3 dv = d.sv - Vec3::UnitY();
    if (axis.x() == 1) {
      EXPECT_LE((dv - angle * axis.cross(Vec3::UnitY())).norm(), 1e-9);
    }
    if (axis.y() == 1) {
      EXPECT_LE((du - angle * axis.cross(Vec3::UnitX())).norm(), 1e-9);
    }
    if (axis.z() == 1) {
      EXPECT_NEAR((du.y() - dv.x()) / 2, angle, 1e-9);
    }
    EXPECT_LE((d.s - rest.evaluate(0.5, 0.5)).norm(), 1e-9) << "a moment does not push";
  }
}

TEST(SculptSystem, RationalSurfacesMeetTheirRows) {
  BSplineSurface rest = curved_surface();
  for (std::size_t i = 0; i < rest.control.size(); ++i)
    rest.weights.push_back(1 + 0.3 * std::sin(1.7 * static_cast<double>(i)));
  SculptSystem system = make(rest);
  const BSplineSurface bent =
      with_control(rest, solved(system, {drag(rest, {0.9, 1.1}, Vec3(0.01, 0.02, 0.03))}).control);
  EXPECT_LE((bent.evaluate(0.9, 1.1) - rest.evaluate(0.9, 1.1) - Vec3(0.01, 0.02, 0.03)).norm(), 1e-11);
}

TEST(SculptSystem, PeriodicSurfacesCloseUp) {
  BSplineSurface tube{KnotVector::uniform_periodic(3, 12).value(), KnotVector::uniform(3, 9).value(), {}, {}};
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 9; ++j) {
      const double angle = 2 * std::numbers::pi * i / 12;
      tube.control.emplace_back(0.3 * std::cos(angle), 0.3 * std::sin(angle), tube.v.greville(j));
    }
  for (const SculptSetup& setup : {SculptSetup{}, free_edges()}) {
    SculptSystem system = make(tube, setup);
    const BSplineSurface bent = with_control(
        tube, solved(system, {drag(tube, {0.0, 0.5}, Vec3(0.1, 0, 0)), drag(tube, {0.5, 0.5}, Vec3::Zero())})
                  .control);
    EXPECT_LE((bent.evaluate(1.0, 0.5) - tube.evaluate(0.0, 0.5) - Vec3(0.1, 0, 0)).norm(), 1e-11);
    const auto moved = [&](double u) -> Vec3 { return bent.evaluate(u, 0.5) - tube.evaluate(u, 0.5); };
    EXPECT_LE((moved(0.02) - moved(0.98)).norm(), 1e-11) << "mirrored alike across the seam";
  }
}

TEST(SculptSystem, BadInputIsNamed) {
  const BSplineSurface rest = curved_surface();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SculptSystem system = make(rest);
  const SculptRow good = drag(rest, {1, 1}, Vec3::Zero());
  const auto field_of = [&](const std::vector<SculptRow>& rows, const std::vector<SculptLoad>& loads) {
    const Result<SculptSolution> solution = system.solve(rows, loads, ConflictPolicy::least_squares);
    return solution.ok() ? std::string("none") : solution.error().field;
  };
  SculptRow row = good;
  row.target.x() = nan;
  EXPECT_EQ(field_of({good, row}, {}), "rows[1].target");
  row = good;
  row.functional.point[0] = 100'000;
  EXPECT_EQ(field_of({good, row}, {}), "rows[1].functional");
  row = good;
  row.functional.value.pop_back();
  EXPECT_EQ(field_of({row}, {}), "rows[0].functional");
  row = good;
  row.along = Vec3::Zero();
  EXPECT_EQ(field_of({row}, {}), "rows[0].along");
  row = good;
  row.tolerance = nan;
  EXPECT_EQ(field_of({row}, {}), "rows[0].tolerance");
  row = good;
  row.target.x() = 1e308;
  row.target.y() = -1e308;
  EXPECT_NE(
      field_of({row, point_row(rest, {1.001, 1}, PointAspect::position, Vec3(-1e308, 0, 1e308)).value()}, {}),
      "none");
  EXPECT_EQ(field_of({}, {{good.functional, Vec3(0, nan, 0)}}), "loads[0].force");
  EXPECT_EQ(field_of(std::vector<SculptRow>(SculptSystem::max_rows + 1, good), {}), "rows");
  EXPECT_EQ(field_of({good}, {}), "none") << "and a refusal leaves nothing behind";
  EXPECT_FALSE(point_row(rest, {nan, 1}, PointAspect::position, Vec3::Zero()).ok());
  EXPECT_FALSE(normal_rows(rest, {1, 1}, Vec3::Zero()).ok());
  EXPECT_FALSE(collocation_places(rest, std::vector<Vec2>{{0.5, 0.5}}).ok());
  EXPECT_FALSE(collocation_places(rest, std::vector<Vec2>{{0.5, 0.5}, {0.5, nan}}).ok());
  EXPECT_FALSE(collocation_places(rest, std::vector<Vec2>{{0.5, 0.5}, {0.5, 0.5}}).ok());
  EXPECT_FALSE(points_over(rest, {{1, 1}, {1, 1.5}}).ok());
  SculptSetup setup;
  setup.held = {5, 3};
  EXPECT_EQ(SculptSystem::create(rest, setup).error().field, "held[1]");
  setup = {};
  setup.energy.b11 = -1;
  EXPECT_EQ(SculptSystem::create(rest, setup).error().field, "energy.b11");
  EXPECT_EQ(SculptSystem::create(flat_surface(3, 4, 4), SculptSetup{}).error().field, "supports")
      << "all control points are clamped";
  setup = free_edges();
  setup.energy = {0, 0, 0, 1, 0, 0};  // Bends in one direction only: slides freely in the other.
  EXPECT_EQ(SculptSystem::create(rest, setup).error().field, "energy");
}

}  // namespace
}  // namespace handloft::geometry
