// Regions that end where they were picked, and seams of closed surfaces (D9 - D12).

#include "server-model/geometry/region_border.h"

#include <gtest/gtest.h>

#include <numbers>

#include "server-model/geometry/bspline_refine.h"
#include "tests/unit/server-model/geometry/sculpt_shapes.h"

namespace handloft::geometry {
namespace {

constexpr double turn = 8;  // Parameters once around the tube below.

/// A tube along x, 1 m long, closed in v over eight spans, the first from 0 to 1.
BSplineSurface tube(int nu = 10) {
  BSplineSurface surface{KnotVector::uniform(3, nu).value(),
                         KnotVector::periodic(3, {-3, -2, -1, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}).value(),
                         {},
                         {}};
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < 8; ++j) {
      const double angle = 2 * std::numbers::pi * j / 8;
      surface.control.emplace_back(surface.u.greville(i), 0.3 * std::cos(angle), 0.3 * std::sin(angle));
    }
  return surface;
}

SculptSystem system_of(const BSplineSurface& rest, const std::vector<std::uint32_t>& held = {}) {
  SculptSetup setup;
  setup.held = held;
  return SculptSystem::create(rest, setup).value();
}

BSplineSurface solved(const BSplineSurface& rest, const std::vector<SculptRow>& rows,
                      const std::vector<SculptLoad>& loads = {},
                      const std::vector<std::uint32_t>& held = {}) {
  SculptSystem system = system_of(rest, held);
  const Result<SculptSolution> solution = system.solve(rows, loads, ConflictPolicy::refuse);
  EXPECT_TRUE(solution.ok()) << (solution ? "" : solution.error().describe());
  const SculptResidual residual = system.residual(rows, loads, *solution);
  EXPECT_LE(residual.stationarity, 1e-10);
  return with_control(rest, solution->control);
}

BSplineSurface with_border(const BSplineSurface& rest, const RegionBorder& border) {
  return insert_knots(insert_knots(rest, Direction::u, border.u).value(), Direction::v, border.v).value();
}

Eigen::Isometry3d lifted_and_turned() {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.translate(Vec3(0.01, -0.02, 0.05)).rotate(Eigen::AngleAxisd(0.15, Vec3(1, 2, 1).normalized()));
  return motion;
}

double largest_between(const BSplineSurface& a, const BSplineSurface& b) {
  double largest = 0;
  for (int i = 0; i <= 97; ++i)
    for (int j = 0; j <= 97; ++j) {
      const double u = a.u.lower() + a.u.length() * i / 97, v = a.v.lower() + a.v.length() * j / 97;
      largest = std::max(largest, (a.evaluate(u, v) - b.evaluate(u, v)).norm());
    }
  return largest;
}

TEST(RegionBorder, D11KnotsThereMoveNothing) {
  const BSplineSurface sheet = curved_surface(), ring = tube();
  for (const BSplineSurface* rest : {&sheet, &ring}) {
    const RegionBorder border = region_border(*rest, {{0.31, 0.55}, {0.74, 1.17}}, 0).value();
    EXPECT_EQ(border.u, (std::vector{0.31, 0.74}));
    EXPECT_EQ(border.v, (std::vector{0.55, 1.17}));
    const BSplineSurface finer = with_border(*rest, border);
    EXPECT_EQ(static_cast<std::size_t>(finer.u.control_count()), border.control_u);
    EXPECT_EQ(static_cast<std::size_t>(finer.v.control_count()), border.control_v);
    EXPECT_LE(largest_between(*rest, finer), 1e-12);
    EXPECT_FALSE(on_knots(*rest, border.region));
    EXPECT_TRUE(on_knots(finer, border.region));
  }
}

TEST(RegionBorder, D11TheRectangleIsHeldAndNothingBeyondIt) {
  const BSplineSurface before = curved_surface();
  const UvRectangle picked{{0.53, 0.78}, {1.03, 1.22}};
  const RegionBorder border = region_border(before, picked, 0).value();
  ASSERT_EQ(border.region.lower, picked.lower);
  ASSERT_EQ(border.region.upper, picked.upper);
  const BSplineSurface rest = with_border(before, border);
  const Eigen::Isometry3d motion = lifted_and_turned();
  const BSplineSurface bent = solved(rest, region_rows(rest, picked, motion).value());
  double largest = 0, beside = 1;
  for (int i = 0; i <= 100; ++i)
    for (int j = 0; j <= 100; ++j) {
      const double u = 0.53 + 0.005 * i, v = 0.78 + 0.0044 * j;
      largest = std::max(largest, (bent.evaluate(u, v) - motion * rest.evaluate(u, v)).norm());
    }
  EXPECT_LE(largest, 1e-9) << "sampled densely";
  // Beyond, it leaves the motion with the third power of the distance, from the border on.
  for (const Vec2& uv : {Vec2(0.50, 1.0), Vec2(1.06, 1.0), Vec2(0.8, 0.75), Vec2(0.8, 1.25)})
    beside =
        std::min(beside, (bent.evaluate(uv.x(), uv.y()) - motion * rest.evaluate(uv.x(), uv.y())).norm());
  EXPECT_GT(beside, 1e-6) << "outside is free";
  // Without the knots the same rectangle holds up to the next ones.
  const BSplineSurface coarse = solved(before, region_rows(before, picked, motion).value());
  EXPECT_LE((coarse.evaluate(0.5, 1.0) - motion * before.evaluate(0.5, 1.0)).norm(), 1e-9)
      << "the control: what this test is about";
}

TEST(RegionBorder, D11InsideDeformsWhileAllElseStays) {
  const BSplineSurface before = curved_surface();
  const RegionBorder border = region_border(before, {{0.62, 0.72}, {0.88, 0.98}}, 6).value();
  const BSplineSurface rest = with_border(before, border);
  const std::vector<std::uint32_t> held = points_outside(rest, border.region).value();
  EXPECT_EQ(rest.control.size() - held.size(), 9U) << "three functions a direction are its own";
  const Vec2 middle(0.75, 0.85);
  const Vec3 target = rest.evaluate(middle.x(), middle.y()) + Vec3(0, 0, 0.01);
  const BSplineSurface bent =
      solved(rest, {point_row(rest, middle, PointAspect::position, target).value()}, {}, held);
  EXPECT_LE((bent.evaluate(middle.x(), middle.y()) - target).norm(), 1e-10);
  for (double u = 0; u <= 2; u += 0.02) {
    for (double v = 0; v <= 2; v += 0.02) {
      if (u > 0.62 && u < 0.88 && v > 0.72 && v < 0.98) continue;
      EXPECT_EQ(bent.evaluate(u, v), rest.evaluate(u, v)) << u << " " << v;
    }
  }
  EXPECT_EQ(points_outside(before, {{0.62, 0.72}, {0.88, 0.98}})->size(), before.control.size())
      << "the control: without knots nothing is its own";
}

TEST(RegionBorder, SidesNearAKnotAreThere) {
  const BSplineSurface rest = curved_surface();  // Knots 0.5 and 1.1, 0.7 and 1.3 among others.
  const RegionBorder near = region_border(rest, {{0.5001, 0.6999}, {1.0999, 1.3002}}, 0).value();
  EXPECT_TRUE(near.u.empty() && near.v.empty());
  EXPECT_EQ(near.region.lower, Vec2(0.5, 0.7));
  EXPECT_EQ(near.region.upper, Vec2(1.1, 1.3));
  const RegionBorder ends = region_border(rest, {{0.001, 0}, {1.9999, 2}}, 0).value();
  EXPECT_TRUE(ends.u.empty() && ends.v.empty());
  EXPECT_EQ(ends.region.upper, Vec2(2, 2));
}

TEST(RegionBorder, SliversAreSaidAndHeldAtPlaces) {
  const BSplineSurface rest = curved_surface();
  const UvRectangle sliver{{0.72, 0.8}, {0.7201, 1.2}};
  const RegionBorder border = region_border(rest, sliver, 0).value();
  EXPECT_TRUE(border.is_sliver);
  EXPECT_TRUE(border.u.empty() && border.v.empty());
  EXPECT_EQ(border.region.lower, sliver.lower) << "as picked";
  const std::vector<CurvePlace> places = region_places(rest, sliver).value();
  EXPECT_EQ(places.size(), 4U * 7U) << "4 across; 2 spans of 3 along, ends once";
  std::vector<Vec3> targets;
  for (const CurvePlace& place : places)
    targets.push_back(rest.evaluate(place.uv.x(), place.uv.y()) + Vec3(0, 0, 0.05));
  const BSplineSurface bent = solved(rest, curve_rows(rest, places, targets, 1e-4 * extent(rest)).value());
  for (double s = 0; s <= 1; s += 0.01)
    EXPECT_LE((bent.evaluate(0.72 + 1e-4 * s, 0.8 + 0.4 * s) - rest.evaluate(0.72 + 1e-4 * s, 0.8 + 0.4 * s) -
               Vec3(0, 0, 0.05))
                  .norm(),
              1e-4 * extent(rest));
}

TEST(RegionBorder, D11AsAPenaltyItIsPulledAndInTheLimitHeld) {
  const BSplineSurface rest = curved_surface();
  const UvRectangle region{{0.53, 0.78}, {1.03, 1.22}};
  const std::vector<CurvePlace> places = area_quadrature(rest, region).value();
  std::vector<Vec3> targets;
  for (const CurvePlace& place : places)
    targets.push_back(rest.evaluate(place.uv.x(), place.uv.y()) + Vec3(0, 0, 0.05));
  const auto off_at = [&](double stiffness) {
    const std::vector<SculptRow> rows = spring_rows(rest, places, targets, stiffness).value();
    SculptSystem system = system_of(rest);
    const SculptSolution solution = system.solve(rows, {}, ConflictPolicy::refuse).value();
    EXPECT_LE(system.residual(rows, {}, solution).stationarity, 1e-10);
    const BSplineSurface bent = with_control(rest, solution.control);
    double off = 0, area = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Vec2& uv = places[i].uv;
      off += places[i].weight_m * (bent.evaluate(uv.x(), uv.y()) - targets[i]).squaredNorm();
      area += places[i].weight_m;
    }
    return std::sqrt(off / area);
  };
  EXPECT_NEAR(off_at(1e-6), 0.05, 1e-6) << "as good as none";
  double last = 0.05;
  for (const double stiffness : {1e1, 1e2, 1e3, 1e4, 1e6, 1e9}) {
    const double off = off_at(stiffness);
    EXPECT_LT(off, last) << stiffness;
    last = off;
  }
  EXPECT_LE(last, 1e-4 * extent(rest)) << "the limit is the constraint, as far as digits tell";
  // The minimum itself: the energy and half of k times the mean square, by loads that pull as the springs do.
  const std::vector<SculptRow> rows = spring_rows(rest, places, targets, 100).value();
  SculptSystem system = system_of(rest);
  const SculptSolution solution = system.solve(rows, {}, ConflictPolicy::refuse).value();
  const BSplineSurface bent = with_control(rest, solution.control);
  std::vector<SculptLoad> pulls;
  double area = 0;
  for (const CurvePlace& place : places) area += place.weight_m;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec2& uv = places[i].uv;
    pulls.push_back(
        point_load(rest, uv, 100 * places[i].weight_m / area * (targets[i] - bent.evaluate(uv.x(), uv.y())))
            .value());
  }
  const SculptSolution pulled = system.solve({}, pulls, ConflictPolicy::refuse).value();
  EXPECT_LE(largest_difference(solution.control, pulled.control), 1e-12);
}

TEST(RegionBorder, RefusesSpringsOfNoStiffnessAndExtent) {
  const BSplineSurface rest = curved_surface();
  const std::vector<CurvePlace> places = area_quadrature(rest, {{0.5, 0.7}, {0.6, 1}}).value();
  const std::vector<Vec3> targets(places.size(), Vec3::Zero());
  for (const double stiffness : {0.0, -1.0, double(NAN), double(INFINITY)})
    EXPECT_EQ(spring_rows(rest, places, targets, stiffness).error().field, "stiffness");
  EXPECT_EQ(spring_rows(rest, {}, {}, 1).error().field, "places");
  EXPECT_FALSE(spring_rows(rest, places, std::vector<Vec3>(3, Vec3::Zero()), 1).ok());
}

TEST(Seam, RegionsAreBroughtToTheDomain) {
  const BSplineSurface rest = tube();
  const UvRectangle across = region_of(rest, {0.2, 9.5}, {0.6, 7.25}).value();
  EXPECT_EQ(across.lower, Vec2(0.2, 7.25));
  EXPECT_EQ(across.upper, Vec2(0.6, 9.5));
  EXPECT_EQ(region_of(rest, {0.2, -0.75}, {0.6, 1.5})->lower, Vec2(0.2, 7.25)) << "the same, a turn before";
  EXPECT_EQ(region_of(rest, {0.2, -0.75}, {0.6, 1.5})->upper, Vec2(0.6, 9.5));
  EXPECT_EQ(region_of(rest, {0.2, 3}, {0.6, 30})->upper, Vec2(0.6, turn)) << "all around";
  EXPECT_EQ(region_of(rest, {-5, 3}, {5, 4})->lower, Vec2(0, 3)) << "the open direction has an end";
  EXPECT_FALSE(region_of(rest, {0.2, 3}, {0.2, 4}).ok());
  EXPECT_FALSE(region_of(rest, {2, 3}, {3, 4}).ok()) << "beyond the end";
  EXPECT_FALSE(region_of(rest, {0.2, NAN}, {0.3, 4}).ok());
}

TEST(Seam, PickedPlacesGoTheShorterWay) {
  const std::vector<Vec2> picked{{0.1, 7.5}, {0.2, 0.5}, {0.3, 2}, {0.3, 7}};
  const std::vector<Vec2> way = without_jumps(tube(), picked);
  EXPECT_EQ(way[1], Vec2(0.2, 8.5));
  EXPECT_EQ(way[2], Vec2(0.3, 10));
  EXPECT_EQ(way[3], Vec2(0.3, 7)) << "three before, not five on";
  EXPECT_EQ(without_jumps(curved_surface(), picked), picked);
}

// The tube is the same from every span on: what crosses the seam is what does not, turned.
TEST(Seam, D11ARegionAcrossIsAsOneElsewhereTurned) {
  const BSplineSurface before = tube();
  const auto bent_at = [&](double start) {
    const UvRectangle region = region_of(before, {0.31, start}, {0.64, start + 2.3}).value();
    const BSplineSurface rest = with_border(before, region_border(before, region, 0).value());
    const double angle = 2 * std::numbers::pi * start / turn;
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    motion.translate(Eigen::AngleAxisd(angle, Vec3::UnitX()) * Vec3(0.02, 0.03, 0.07));
    const BSplineSurface bent = solved(rest, region_rows(rest, region, motion).value());
    for (int i = 0; i <= 50; ++i)
      for (int j = 0; j <= 50; ++j) {
        const double u = 0.31 + 0.33 * i / 50, v = start + 2.3 * j / 50;
        EXPECT_LE((bent.evaluate(u, v) - motion * rest.evaluate(u, v)).norm(), 1e-9);
      }
    return bent;
  };
  const BSplineSurface within = bent_at(2.4), across = bent_at(6.4), before_it = bent_at(-1.6);
  const Eigen::AngleAxisd half(std::numbers::pi, Vec3::UnitX());
  double largest = 0;
  for (double u = 0; u <= 1; u += 0.05)
    for (double v = 0; v < turn; v += 0.1) {
      largest = std::max(largest, (half * within.evaluate(u, v) - across.evaluate(u, v + 4)).norm());
      EXPECT_LE((across.evaluate(u, v) - before_it.evaluate(u, v)).norm(), 1e-9);
    }
  EXPECT_LE(largest, 1e-9);
}

TEST(Seam, D11InsideAcrossWhileAllElseStays) {
  const BSplineSurface before = tube();
  const UvRectangle region = region_of(before, {0.31, 6.6}, {0.64, 9.4}).value();
  const RegionBorder border = region_border(before, region, 6).value();
  const BSplineSurface rest = with_border(before, border);
  EXPECT_LE(largest_between(before, rest), 1e-12);
  const std::vector<std::uint32_t> held = points_outside(rest, border.region).value();
  const Vec3 target = rest.evaluate(0.475, 8) + Vec3(0, 0.05, 0);
  const BSplineSurface bent =
      solved(rest, {point_row(rest, {0.475, 0}, PointAspect::position, target).value()}, {}, held);
  EXPECT_LE((bent.evaluate(0.475, 8) - target).norm(), 1e-10);
  EXPECT_GT((bent.evaluate(0.475, 7.7) - rest.evaluate(0.475, 7.7)).norm(), 1e-3) << "before the seam too";
  EXPECT_GT((bent.evaluate(0.475, 0.3) - rest.evaluate(0.475, 0.3)).norm(), 1e-3);
  for (double u = 0; u <= 1; u += 0.02)
    for (double v = 1.4; v <= 6.6; v += 0.02) EXPECT_EQ(bent.evaluate(u, v), rest.evaluate(u, v));
}

TEST(Seam, WholeTurnsHoldAllAround) {
  const BSplineSurface rest = tube(12);  // Knots every ninth.
  const UvRectangle ring = region_of(rest, {3 / 9.0, 5}, {6 / 9.0, 5 + turn}).value();
  EXPECT_TRUE(on_knots(rest, ring));
  EXPECT_EQ(points_over(rest, ring)->size(), 6U * 8U) << "3 spans and the degree";
  EXPECT_EQ(points_outside(rest, ring)->size(), rest.control.size()) << "three spans are no function's";
}

TEST(Seam, D9ACurveAcrossIsMetOnBothSides) {
  const BSplineSurface rest = tube();
  const std::vector<Vec2> line{{0.4, 6.5}, {0.5, 9.75}};
  const std::vector<CurvePlace> places = collocation_places(rest, line).value();
  EXPECT_EQ(places.size(), 5U * 4U + 2U) << "knots 7, 8, 9 and one of u, by the tube's own";
  std::vector<Vec3> targets;
  for (const CurvePlace& place : places)
    targets.push_back(rest.evaluate(place.uv.x(), place.uv.y()) + Vec3(0, 0.03, 0.02));
  const BSplineSurface bent = solved(rest, curve_rows(rest, places, targets, 1e-4 * extent(rest)).value());
  for (double s = 0; s <= 1; s += 0.005) {
    const Vec2 uv = line[0] + s * (line[1] - line[0]);
    EXPECT_LE((bent.evaluate(uv.x(), uv.y()) - rest.evaluate(uv.x(), uv.y()) - Vec3(0, 0.03, 0.02)).norm(),
              1e-4 * extent(rest));
  }
  // All around along a parameter line: exact, with as many rows as the ring has control points (D9).
  const std::vector<Vec2> ring{{0.37, 3}, {0.37, 3 + turn}};
  const std::vector<CurvePlace> around = collocation_places(rest, ring).value();
  std::vector<Vec3> wider;
  for (const CurvePlace& place : around)
    wider.push_back(rest.evaluate(place.uv.x(), place.uv.y()).cwiseProduct(Vec3(1, 1.2, 1.2)));
  SculptSystem system = system_of(rest);
  const SculptSolution solution =
      system.solve(curve_rows(rest, around, wider, 1e-4).value(), {}, ConflictPolicy::refuse).value();
  const SculptSolution hard =
      system.solve(curve_rows(rest, around, wider, 0).value(), {}, ConflictPolicy::refuse).value();
  EXPECT_EQ(around.size() - hard.dependent.size(), 8U);
  const BSplineSurface swollen = with_control(rest, solution.control);
  for (double v = 0; v < turn; v += 0.01)
    EXPECT_LE((swollen.evaluate(0.37, v) - rest.evaluate(0.37, v).cwiseProduct(Vec3(1, 1.2, 1.2))).norm(),
              1e-9);
}

TEST(Seam, D10AndD12LengthsAndAreasAcross) {
  const BSplineSurface rest = tube();
  const auto sum = [](const std::vector<CurvePlace>& places) {
    double all = 0;
    for (const CurvePlace& place : places) all += place.weight_m;
    return all;
  };
  EXPECT_NEAR(sum(line_quadrature(rest, std::vector<Vec2>{{0.5, 6.5}, {0.5, 9.5}}).value()),
              sum(line_quadrature(rest, std::vector<Vec2>{{0.5, 2.5}, {0.5, 5.5}}).value()), 1e-12);
  EXPECT_NEAR(sum(area_quadrature(rest, {{0.25, 6.5}, {0.75, 9.5}}).value()),
              sum(area_quadrature(rest, {{0.25, 2.5}, {0.75, 5.5}}).value()), 1e-12);
  const double circle = sum(line_quadrature(rest, std::vector<Vec2>{{0.5, 0}, {0.5, turn}}).value());
  EXPECT_NEAR(sum(line_quadrature(rest, std::vector<Vec2>{{0.5, -1}, {0.5, 2 * turn - 1}}).value()),
              2 * circle, 1e-12)
      << "twice around";
}

TEST(Seam, TurnsWithoutMeasureAreRefused) {
  const BSplineSurface rest = tube();
  EXPECT_EQ(collocation_places(rest, std::vector<Vec2>{{0.5, 0}, {0.5, 1e9}}).error().code,
            ErrorCode::invalid_argument);
  EXPECT_EQ(collocation_places(rest, std::vector<Vec2>{{0, 0}, {1, 60 * turn}, {0, 0}, {1, 60 * turn}})
                .error()
                .code,
            ErrorCode::resource_exhausted);
  EXPECT_FALSE(points_over(rest, {{0, 0}, {1, 2 * turn}}).ok());
  EXPECT_FALSE(points_over(rest, {{0, 1e9}, {1, 1e9 + 1}}).ok());
}

// A short curve says by extrapolation what the surface is beyond its ends; points are held there all the
// same.
struct BesideACurve {
  Status status;
  double curve = 0, points = 0, reported = 0;  // Largest distances, and from what was reported.
  double moved = 0;                            // The farthest control point.
};

BesideACurve beside_a_curve(double lift_after, double lift_before, ConflictPolicy policy) {
  const BSplineSurface rest = curved_surface();
  const std::vector<Vec2> line{{0.95, 1.1}, {0.953, 1.1015}};
  const std::vector<CurvePlace> places = collocation_places(rest, line).value();
  std::vector<Vec3> targets;
  for (const CurvePlace& place : places)
    targets.push_back(rest.evaluate(place.uv.x(), place.uv.y()) + Vec3(0, 0, 0.05));
  std::vector<SculptRow> rows = curve_rows(rest, places, targets, 1e-4 * extent(rest)).value();
  for (const Vec2& uv : {Vec2(0.97, 1.12), Vec2(0.93, 1.08), Vec2(0.96, 1.06), Vec2(1.05, 1.2)})
    rows.push_back(
        point_row(rest, uv, PointAspect::position,
                  rest.evaluate(uv.x(), uv.y()) + Vec3(0, 0, uv.x() > 0.955 ? lift_after : lift_before))
            .value());
  SculptSystem system = system_of(rest);
  const Result<SculptSolution> solution = system.solve(rows, {}, policy);
  BesideACurve result;
  if (!solution) {
    result.status = solution.error();
    return result;
  }
  for (std::size_t row = 0; row < rows.size(); ++row) {
    Vec3 value = -rows[row].target;
    for (std::size_t k = 0; k < rows[row].functional.point.size(); ++k)
      value += rows[row].functional.value[k] * solution->control[rows[row].functional.point[k]];
    double& most = row < places.size() ? result.curve : result.points;
    most = std::max(most, value.norm());
    result.reported = std::max(result.reported, std::abs(value.norm() - solution->off[row]));
  }
  for (std::size_t i = 0; i < rest.control.size(); ++i)
    result.moved = std::max(result.moved, (solution->control[i] - rest.control[i]).norm());
  return result;
}

TEST(SoftRows, D9D20PointsBesideAShortCurveAreMetAndTheCurveNearly) {
  const BesideACurve result = beside_a_curve(0.051, 0.05, ConflictPolicy::refuse);
  ASSERT_TRUE(result.status.ok()) << result.status.error().describe();
  EXPECT_LE(result.points, 1e-10) << "points do not give way to a curve";
  EXPECT_LE(result.curve, 1e-4 * extent(curved_surface())) << "D9";
  EXPECT_LE(result.reported, 1e-10) << "what it is off is told";
  EXPECT_LE(result.moved, 8 * 0.051) << "nothing is forced at the price of waves but by the points";
}

TEST(SoftRows, D20APointTooHighBesideACurveIsAConflict) {
  const BesideACurve refused = beside_a_curve(0.1, 0.04, ConflictPolicy::refuse);
  ASSERT_FALSE(refused.status.ok());
  EXPECT_EQ(refused.status.error().code, ErrorCode::failed_precondition);
  const BesideACurve nearest = beside_a_curve(0.1, 0.04, ConflictPolicy::least_squares);
  ASSERT_TRUE(nearest.status.ok());
  EXPECT_LE(nearest.points, 1e-10);
  EXPECT_GT(nearest.curve, 1e-4 * extent(curved_surface()));
  EXPECT_LE(nearest.reported, 1e-10);
}

TEST(SoftRows, D20TheSameCurveTwiceIsTold) {
  const BSplineSurface rest = curved_surface();
  const std::vector<CurvePlace> places =
      collocation_places(rest, std::vector<Vec2>{{0.4, 0.5}, {1.0, 1.4}}).value();
  std::vector<Vec3> targets;
  for (const CurvePlace& place : places) targets.push_back(rest.evaluate(place.uv.x(), place.uv.y()));
  const std::vector<SculptRow> once = curve_rows(rest, places, targets, 1e-4).value();
  std::vector<SculptRow> twice = once;
  twice.insert(twice.end(), once.begin(), once.end());
  SculptSystem system = system_of(rest);
  EXPECT_TRUE(system.solve(once, {}, ConflictPolicy::refuse).value().dependent.empty());
  const SculptSolution solution = system.solve(twice, {}, ConflictPolicy::refuse).value();
  ASSERT_EQ(solution.dependent.size(), once.size());
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(solution.dependent[i].row, once.size() + i);
    EXPECT_EQ(solution.dependent[i].on, std::vector<std::size_t>{i});
  }
}

}  // namespace
}  // namespace handloft::geometry
