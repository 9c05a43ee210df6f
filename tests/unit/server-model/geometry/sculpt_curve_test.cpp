// The same system over a curve (D1): beams and strings, whose formulas are known.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/server-model/geometry/sculpt_shapes.h"

namespace handloft::geometry {
namespace {

BSplineCurve straight(int count) {
  BSplineCurve curve{KnotVector::uniform(3, count).value(), {}, {}};
  for (int i = 0; i < count; ++i) curve.control.emplace_back(curve.knots.greville(i), 0, 0);
  return curve;
}

BSplineCurve with_control(BSplineCurve curve, const std::vector<Vec3>& control) {
  curve.control = control;
  return curve;
}

TEST(SculptCurve, BeamWithAPointLoadDeflectsAsTheFormulaSays) {
  // Simply supported: P L^3 / (48 E I); clamped: P L^3 / (192 E I). With the load on a
  // knot the exact solution is a C2 cubic, which the spline has but for rounding.
  const BSplineCurve beam = straight(11);  // 8 spans: 0.5 is a knot.
  const SculptLoad load{curve_functional(beam, 0.5, 0).value(), Vec3(0, 0, 1)};
  for (const Support support : {Support::supported, Support::clamped}) {
    SculptSystem system =
        SculptSystem::create(beam, {0, 2, support, support, SculptMode::displacement}).value();
    const SculptSolution bent = system.solve({}, std::vector{load}, ConflictPolicy::refuse).value();
    const double expected = 1 / ((support == Support::supported ? 48.0 : 192.0) * 2);
    EXPECT_NEAR(with_control(beam, bent.control).evaluate(0.5).z(), expected, 1e-13);
    EXPECT_LE(system.residual({}, std::vector{load}, bent).stationarity, 1e-10);
  }
}

TEST(SculptCurve, StringWithAPointLoadIsATriangle) {  // alpha alone: P L / (4 T), linear elements are exact
  BSplineCurve string{KnotVector::uniform(1, 9).value(), {}, {}};
  for (int i = 0; i < 9; ++i) string.control.emplace_back(i / 8.0, 0, 0);
  SculptSystem system =
      SculptSystem::create(string, {3, 0, Support::supported, Support::supported, SculptMode::displacement})
          .value();
  const SculptLoad load{curve_functional(string, 0.5, 0).value(), Vec3(0, 1, 0)};
  const SculptSolution bent = system.solve({}, std::vector{load}, ConflictPolicy::refuse).value();
  EXPECT_NEAR(bent.control[4].y(), 1.0 / 12, 1e-14);
  EXPECT_NEAR(bent.control[2].y(), 1.0 / 24, 1e-14);
}

TEST(SculptCurve, MeetsPositionsTangentsAndNormals) {
  BSplineCurve arc = straight(14);
  for (Vec3& point : arc.control) point.z() = 0.2 * std::sin(3 * point.x());
  for (const Support support : {Support::clamped, Support::free}) {
    SculptSystem system =
        SculptSystem::create(arc, {0.05, 1, support, support, SculptMode::displacement}).value();
    std::vector<SculptRow> rows{
        curve_point_row(arc, 0.3, 0, arc.evaluate(0.3) + Vec3(0.01, 0.05, 0.1)).value(),
        curve_point_row(arc, 0.6, 1, Vec3(1, 0.2, 0.1)).value(),
        curve_point_row(arc, 0.8, 2, Vec3(0.1, 0.2, 0.3)).value(),
        {curve_functional(arc, 0.4, 1).value(), Vec3::Zero(), Vec3(0, 1, 1), 0}};
    const SculptSolution bent = system.solve(rows, {}, ConflictPolicy::refuse).value();
    const BSplineCurve curve = with_control(arc, bent.control);
    EXPECT_LE((curve.evaluate(0.3) - rows[0].target).norm(), 1e-11);
    EXPECT_LE((curve.derivatives(0.6, 1)[1] - Vec3(1, 0.2, 0.1)).norm(), 1e-10);
    EXPECT_LE((curve.derivatives(0.8, 2)[2] - Vec3(0.1, 0.2, 0.3)).norm(), 1e-9);
    EXPECT_NEAR(curve.derivatives(0.4, 1)[1].dot(Vec3(0, 1, 1)), 0, 1e-10);
    const SculptResidual residual = system.residual(rows, {}, bent);
    EXPECT_LE(residual.stationarity, 1e-10);
    EXPECT_LE(residual.constraints, 1e-10);
  }
}

TEST(SculptCurve, ClosedCurveMovesAsABody) {
  BSplineCurve ring{KnotVector::uniform_periodic(3, 10).value(), {}, {}};
  for (int i = 0; i < 10; ++i)
    ring.control.emplace_back(std::cos(0.2 * std::numbers::pi * i), std::sin(0.2 * std::numbers::pi * i), 0);
  SculptSystem system = SculptSystem::create(ring, CurveSculptSetup{}).value();
  const Vec3 by(0.1, 0.2, 0.3);
  const SculptRow row = curve_point_row(ring, 0.25, 0, ring.evaluate(0.25) + by).value();
  const SculptSolution moved = system.solve(std::vector{row}, {}, ConflictPolicy::refuse).value();
  for (std::size_t i = 0; i < ring.control.size(); ++i)
    EXPECT_LE((moved.control[i] - ring.control[i] - by).norm(), 1e-13);
}

TEST(SculptCurve, RationalFunctionalsAreThoseOfTheCurve) {
  BSplineCurve curve = straight(8);
  for (std::size_t i = 0; i < curve.control.size(); ++i) {
    curve.weights.push_back(1 + 0.4 * std::cos(2.0 * static_cast<double>(i)));
    curve.control[i].z() = std::sin(1.0 + static_cast<double>(i));
  }
  for (const double u : {0.0, 0.13, 0.5, 1.0}) {
    for (int a = 0; a <= 2; ++a) {
      const SurfaceFunctional functional = curve_functional(curve, u, a).value();
      Vec3 sum = Vec3::Zero();
      for (std::size_t i = 0; i < functional.point.size(); ++i)
        sum += functional.value[i] * curve.control[functional.point[i]];
      EXPECT_LE((sum - curve.derivatives(u, 2)[static_cast<std::size_t>(a)]).norm(), 1e-10) << u << ' ' << a;
    }
  }
  EXPECT_FALSE(curve_functional(curve, 0.5, 3).ok());
  EXPECT_FALSE(curve_functional(curve, std::nan(""), 0).ok());
}

TEST(SculptCurve, RefusesWhatIsNoEnergy) {
  for (const CurveSculptSetup& wrong :
       {CurveSculptSetup{0, 0}, CurveSculptSetup{-1, 1}, CurveSculptSetup{1, NAN}})
    EXPECT_EQ(SculptSystem::create(straight(8), wrong).error().field, "energy");
}

}  // namespace
}  // namespace handloft::geometry
