#include "server-model/geometry/bspline_curve.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "bspline_samples.h"

namespace handloft::geometry {
namespace {

using samples::Kind;
using samples::Random;
using samples::Weights;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(BSplineCurve, CircleIsRound) {
  const BSplineCurve circle = samples::circle();
  ASSERT_TRUE(check(circle).ok());
  for (const double u : samples::parameters(circle.knots, 100)) {
    const auto c = circle.derivatives(u, 3);
    EXPECT_NEAR(c[0].norm(), 1, 1e-15);
    EXPECT_NEAR(c[0].dot(c[1]), 0, 1e-14);
    // Curvature 1.
    const double speed = c[1].norm();
    EXPECT_NEAR((c[1].x() * c[2].y() - c[1].y() * c[2].x()) / (speed * speed * speed), 1, 1e-13);
    // It is constant: with x' y''' - y' x''' = 3 speed^2 (x' x'' + y' y'').
    EXPECT_NEAR(c[1].x() * c[3].y() - c[1].y() * c[3].x(), 3 * speed * c[1].dot(c[2]), 1e-10 * speed * speed);
  }
  // By hand: an eighth of the way round.
  EXPECT_LT((circle.evaluate(0.125) - Vec3(std::sqrt(0.5), std::sqrt(0.5), 0)).norm(), 1e-15);
}

TEST(BSplineCurve, NurbsBookExample) {
  // Piegl and Tiller, Ex4.1: U = {0,0,0,1,2,3,3,3}, w = {1,4,1,1,1}, P = (0,0),(1,1),(3,2),(4,1),(5,-1): at
  // u = 1 the point (7/5, 6/5).
  const BSplineCurve curve{KnotVector::open(2, {0, 0, 0, 1, 2, 3, 3, 3}).value(),
                           {{0, 0, 0}, {1, 1, 0}, {3, 2, 0}, {4, 1, 0}, {5, -1, 0}},
                           {1, 4, 1, 1, 1}};
  EXPECT_LT((curve.evaluate(1) - Vec3(1.4, 1.2, 0)).norm(), 1e-15);
}

TEST(BSplineCurve, AgreesWithOcct) {
  Random random(3);
  for (const Kind kind : {Kind::clamped, Kind::unclamped}) {
    for (int p = 1; p <= 12; ++p) {
      for (const Weights weights : {Weights::none, Weights::random}) {
        const BSplineCurve curve = samples::random_curve(random, kind, p, weights);
        const Handle(Geom_BSplineCurve) oracle = samples::to_occt(curve);
        // Derivatives cancel: they are as exact as the largest of them allows. OCCT's scheme of differences
        // loses a digit with each degree or two above 8.
        const double tolerance = p <= 8 ? 1e-12 : 1e-10;
        std::array<double, 4> largest = {1, 1, 1, 1};
        for (const double u : samples::parameters(curve.knots, 100)) {
          const auto c = curve.derivatives(u, 3);
          for (std::size_t k = 0; k < 4; ++k) largest[k] = std::max(largest[k], c[k].norm());
        }
        for (int i = 0; i < 40; ++i) {
          const double u = samples::uniform(random, curve.knots.lower(), curve.knots.upper());
          gp_Pnt point;
          gp_Vec d1, d2, d3;
          oracle->D3(u, point, d1, d2, d3);
          const auto c = curve.derivatives(u, 3);
          const std::array<Vec3, 4> expected = {samples::to_vec(point.XYZ()), samples::to_vec(d1.XYZ()),
                                                samples::to_vec(d2.XYZ()), samples::to_vec(d3.XYZ())};
          for (std::size_t k = 0; k < 4; ++k) {
            EXPECT_LT((c[k] - expected[k]).norm(), tolerance * largest[k])
                << "degree " << p << " derivative " << k;
          }
        }
      }
    }
  }
}

TEST(BSplineCurve, PeriodicOnesAgreeWithOcct) {
  Random random(13);
  for (int p = 1; p <= 6; ++p) {
    BSplineCurve curve = samples::random_curve(random, Kind::periodic, p, Weights::random);
    // OCCT (7.6) does not let functions of so few control points meet themselves; see the next test for
    // these.
    while (curve.control.size() <= static_cast<std::size_t>(p)) {
      curve = samples::random_curve(random, Kind::periodic, p, Weights::random);
    }
    // OCCT names the distinct knots of one period; its first pole acts where the seam's knots begin.
    std::vector<double> period(curve.knots.knots().begin() + p, curve.knots.knots().end() - p);
    const samples::OcctKnots knots(period);
    const int n = curve.knots.control_count();
    TColgp_Array1OfPnt poles(1, n);
    TColStd_Array1OfReal weights(1, n);
    for (int i = 0; i < n; ++i) {
      const Vec3& c = curve.control[static_cast<std::size_t>(i)];
      poles.SetValue(i + 1, gp_Pnt(c.x(), c.y(), c.z()));
      weights.SetValue(i + 1, curve.weights[static_cast<std::size_t>(i)]);
    }
    const Handle(Geom_BSplineCurve) oracle =
        new Geom_BSplineCurve(poles, weights, knots.value_array(), knots.times_array(), p, Standard_True);
    // Both count poles from the same knot or not: the shift is found once and must then hold everywhere.
    const auto distance = [&](int shift) {
      double worst = 0;
      BSplineCurve turned = curve;
      for (int i = 0; i < n; ++i) {
        const auto to = static_cast<std::size_t>((i + shift) % n);
        turned.control[to] = curve.control[static_cast<std::size_t>(i)];
        turned.weights[to] = curve.weights[static_cast<std::size_t>(i)];
      }
      for (const double u : samples::parameters(curve.knots, 50)) {
        worst = std::max(worst, (turned.evaluate(u) - samples::to_vec(oracle->Value(u).XYZ())).norm());
      }
      return worst;
    };
    double best = distance(0);
    for (int shift = 1; shift < n; ++shift) best = std::min(best, distance(shift));
    EXPECT_LT(best, 1e-12) << "degree " << p;
  }
}

TEST(BSplineCurve, TwoPeriodsAsOneAreTheSameCurve) {
  Random random(17);
  for (int p = 1; p <= 7; ++p) {
    for (int round = 0; round < 10; ++round) {
      const BSplineCurve curve = samples::random_curve(random, Kind::periodic, p, Weights::random);
      const long n = curve.knots.control_count();
      std::vector<double> knots;
      for (long i = -p; i <= 2 * n + p; ++i) {
        const long k = i >= 0 ? i / n : -((-i + n - 1) / n);
        knots.push_back(curve.knots.knots()[static_cast<std::size_t>(i - k * n + p)] +
                        static_cast<double>(k) * curve.knots.length());
      }
      const auto twice = KnotVector::periodic(p, knots);
      ASSERT_TRUE(twice.ok()) << twice.error().describe();
      BSplineCurve longer{*twice, curve.control, curve.weights};
      longer.control.insert(longer.control.end(), curve.control.begin(), curve.control.end());
      longer.weights.insert(longer.weights.end(), curve.weights.begin(), curve.weights.end());
      EXPECT_LT(samples::difference(longer, curve), 1e-12) << "degree " << p << " with " << n;
    }
  }
}

TEST(BSplineCurve, DerivativesAreLimitsOfDifferences) {
  Random random(4);
  for (const Weights weights : {Weights::none, Weights::random}) {
    const BSplineCurve curve = samples::random_curve(random, Kind::periodic, 5, weights);
    const double u = curve.knots.lower() + 0.41 * curve.knots.length();
    const double h = 1e-5;
    const auto before = curve.derivatives(u - h, 3);
    const auto at = curve.derivatives(u, 3);
    const auto after = curve.derivatives(u + h, 3);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_LT((at[k + 1] - (after[k] - before[k]) / (2 * h)).norm(), 1e-6 * (1 + at[k + 1].norm()));
    }
  }
}

TEST(BSplineCurve, PeriodsJoinSmoothly) {
  const BSplineCurve ring{
      KnotVector::uniform_periodic(3, 6).value(),
      {{1, 0, 0}, {0.5, 0.9, 0}, {-0.5, 0.9, 0.2}, {-1, 0, 0}, {-0.5, -0.9, 0}, {0.5, -0.9, 0}},
      {}};
  const auto before = ring.derivatives(1 - 1e-13, 2);
  const auto after = ring.derivatives(0, 2);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT((before[k] - after[k]).norm(), 1e-9) << k;
  EXPECT_EQ(ring.evaluate(0.25), ring.evaluate(3.25));
}

TEST(BSplineCurve, HigherDerivativesThanAskedForAreNone) {
  const auto c = samples::circle().derivatives(0.3, 1);
  EXPECT_GT(c[1].norm(), 1);
  EXPECT_EQ(c[2], Vec3(0, 0, 0));
  EXPECT_EQ(c[3], Vec3(0, 0, 0));
  EXPECT_TRUE(samples::circle().evaluate(nan).allFinite());
}

TEST(BSplineCurve, BadNumbersAreNamed) {
  BSplineCurve curve = samples::circle();
  curve.control[3].y() = nan;
  EXPECT_EQ(check(curve).error().field, "control[3]");
  curve = samples::circle();
  curve.control[8].z() = 1e200;
  EXPECT_EQ(check(curve).error().field, "control[8]");
  curve = samples::circle();
  curve.control.pop_back();
  EXPECT_EQ(check(curve).error().field, "control");
  for (const double bad : {0.0, -1.0, nan, 1e300}) {
    curve = samples::circle();
    curve.weights[2] = bad;
    EXPECT_EQ(check(curve).error().field, "weights[2]");
  }
  curve.weights.pop_back();
  EXPECT_EQ(check(curve).error().field, "weights");
}

}  // namespace
}  // namespace handloft::geometry
