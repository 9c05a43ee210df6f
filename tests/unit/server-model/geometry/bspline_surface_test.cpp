#include "server-model/geometry/bspline_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "bspline_samples.h"
#include "server-model/geometry/bspline_grid.h"

namespace handloft::geometry {
namespace {

using samples::Kind;
using samples::Random;
using samples::Weights;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The unit sphere, u round the z axis, v from pole to pole.
BSplineSurface sphere() {
  const BSplineCurve circle = samples::circle();
  BSplineSurface surface{circle.knots, KnotVector::open(2, {0, 0, 0, 0.5, 0.5, 1, 1, 1}).value(), {}, {}};
  const Vec2 half[] = {{0, -1}, {1, -1}, {1, 0}, {1, 1}, {0, 1}};
  const double w = std::sqrt(0.5);
  const double half_weights[] = {1, w, 1, w, 1};
  for (std::size_t i = 0; i < circle.control.size(); ++i) {
    for (std::size_t j = 0; j < 5; ++j) {
      surface.control.emplace_back(half[j].x() * circle.control[i].x(), half[j].x() * circle.control[i].y(),
                                   half[j].y());
      surface.weights.push_back(circle.weights[i] * half_weights[j]);
    }
  }
  return surface;
}

/// All kinds in both directions, with and without weights.
template <typename Test>
void for_surfaces(const Test& test) {
  Random random(11);
  for (const Kind in_u : samples::kinds) {
    for (const Kind in_v : samples::kinds) {
      for (const Weights weights : {Weights::none, Weights::random}) {
        SCOPED_TRACE(testing::Message()
                     << static_cast<int>(in_u) << static_cast<int>(in_v) << static_cast<int>(weights));
        const int p = 1 + static_cast<int>(random() % 5);
        const int q = 1 + static_cast<int>(random() % 5);
        test(samples::random_surface(random, in_u, in_v, p, q, weights), random);
      }
    }
  }
}

TEST(BSplineSurface, SphereIsRound) {
  const BSplineSurface surface = sphere();
  ASSERT_TRUE(check(surface).ok());
  for (const double u : samples::parameters(surface.u, 20)) {
    for (const double v : samples::parameters(surface.v, 20)) {
      const Vec3 place = surface.evaluate(u, v);
      EXPECT_NEAR(place.norm(), 1, 1e-15);
      // The poles, where S_u vanishes, included.
      EXPECT_LT((surface.normal(u, v) - place).norm(), 1e-6);
    }
  }
}

TEST(BSplineSurface, NormalOfNothingIsZero) {
  const BSplineSurface point{KnotVector::uniform(1, 2).value(),
                             KnotVector::uniform(1, 2).value(),
                             std::vector<Vec3>(4, Vec3(1, 2, 3)),
                             {}};
  EXPECT_EQ(point.normal(0.5, 0.5), Vec3(0, 0, 0));
}

TEST(BSplineSurface, AgreesWithOcct) {
  Random random(5);
  for (int round = 0; round < 60; ++round) {
    const Kind in_u = round % 2 == 0 ? Kind::clamped : Kind::unclamped;
    const Kind in_v = round % 3 == 0 ? Kind::unclamped : Kind::clamped;
    const BSplineSurface surface = samples::random_surface(
        random, in_u, in_v, 1 + static_cast<int>(random() % 7), 1 + static_cast<int>(random() % 7),
        round % 5 < 2 ? Weights::random : Weights::none);
    const Handle(Geom_BSplineSurface) oracle = samples::to_occt(surface);
    for (int i = 0; i < 20; ++i) {
      const double u = samples::uniform(random, surface.u.lower(), surface.u.upper());
      const double v = samples::uniform(random, surface.v.lower(), surface.v.upper());
      gp_Pnt point;
      gp_Vec su, sv, suu, svv, suv;
      oracle->D2(u, v, point, su, sv, suu, svv, suv);
      const SurfaceDerivatives d = surface.derivatives(u, v, 2);
      const auto agree = [](const Vec3& a, const gp_XYZ& b) {
        const Vec3 expected = samples::to_vec(b);
        EXPECT_LT((a - expected).norm(), 1e-12 * std::max(1.0, expected.norm()));
      };
      agree(surface.evaluate(u, v), point.XYZ());
      agree(d.s, point.XYZ());
      agree(d.su, su.XYZ());
      agree(d.sv, sv.XYZ());
      agree(d.suu, suu.XYZ());
      agree(d.suv, suv.XYZ());
      agree(d.svv, svv.XYZ());
    }
  }
}

TEST(BSplineSurface, DerivativesAreLimitsOfDifferences) {
  Random random(6);
  const BSplineSurface surface =
      samples::random_surface(random, Kind::periodic, Kind::unclamped, 4, 5, Weights::random);
  const double u = surface.u.lower() + 0.37 * surface.u.length();
  const double v = surface.v.lower() + 0.61 * surface.v.length();
  const double h = 1e-5;
  const SurfaceDerivatives d = surface.derivatives(u, v, 2);
  const auto u0 = surface.derivatives(u - h, v, 1);
  const auto u1 = surface.derivatives(u + h, v, 1);
  const auto v0 = surface.derivatives(u, v - h, 1);
  const auto v1 = surface.derivatives(u, v + h, 1);
  const auto near = [&](const Vec3& a, const Vec3& low, const Vec3& high) {
    EXPECT_LT((a - (high - low) / (2 * h)).norm(), 1e-6 * (1 + a.norm()));
  };
  near(d.su, u0.s, u1.s);
  near(d.sv, v0.s, v1.s);
  near(d.suu, u0.su, u1.su);
  near(d.suv, u0.sv, u1.sv);
  near(d.suv, v0.su, v1.su);
  near(d.svv, v0.sv, v1.sv);
}

TEST(BSplineSurface, FunctionalsGiveTheDerivatives) {
  for_surfaces([](const BSplineSurface& surface, Random& random) {
    const double u = samples::uniform(random, surface.u.lower(), surface.u.upper());
    const double v = samples::uniform(random, surface.v.lower(), surface.v.upper());
    const SurfaceDerivatives d = surface.derivatives(u, v, 2);
    const auto apply = [&](int a, int b) {
      const auto functional = surface_functional(surface, u, v, a, b);
      EXPECT_TRUE(functional.ok());
      Vec3 total = Vec3::Zero();
      for (std::size_t k = 0; k < functional->point.size(); ++k) {
        if (k > 0) {
          EXPECT_LT(functional->point[k - 1], functional->point[k]);
        }
        total += functional->value[k] * surface.control[functional->point[k]];
      }
      return total;
    };
    const auto agree = [](const Vec3& a, const Vec3& b) {
      EXPECT_LT((a - b).norm(), 1e-11 * (1 + b.norm()));
    };
    agree(apply(0, 0), d.s);
    agree(apply(1, 0), d.su);
    agree(apply(0, 1), d.sv);
    agree(apply(2, 0), d.suu);
    agree(apply(1, 1), d.suv);
    agree(apply(0, 2), d.svv);
    EXPECT_FALSE(surface_functional(surface, u, v, -1, 0).ok());
    EXPECT_FALSE(surface_functional(surface, u, v, 2, 2).ok());
    EXPECT_EQ(surface_functional(surface, u, v, 2, 1).ok(), !surface.is_rational());
  });
}

TEST(BSplineSurface, GridsHoldThePlacesAndNormals) {
  for_surfaces([](const BSplineSurface& surface, Random&) {
    const std::vector<double> us = samples::parameters(surface.u, 7);
    const std::vector<double> vs = samples::parameters(surface.v, 9);
    std::vector<Vec3> places, normals, alone;
    evaluate_grid(surface, us, vs, places, &normals);
    evaluate_grid(surface, us, vs, alone);
    ASSERT_EQ(places.size(), us.size() * vs.size());
    ASSERT_EQ(normals.size(), places.size());
    ASSERT_EQ(alone.size(), places.size());
    for (std::size_t r = 0; r < us.size(); ++r) {
      for (std::size_t c = 0; c < vs.size(); ++c) {
        const std::size_t i = r * vs.size() + c;
        EXPECT_LT((places[i] - surface.evaluate(us[r], vs[c])).norm(), 1e-13);
        EXPECT_LT((alone[i] - places[i]).norm(), 1e-13);
        EXPECT_LT((normals[i] - surface.normal(us[r], vs[c])).norm(), 1e-9);
      }
    }
  });
}

TEST(BSplineSurface, GridsReachPoles) {
  const BSplineSurface surface = sphere();
  const std::vector<double> us = {0, 0.1, 0.7, 1};
  const std::vector<double> vs = {0, 0.5, 1};
  std::vector<Vec3> places, normals;
  evaluate_grid(surface, us, vs, places, &normals);
  for (std::size_t i = 0; i < places.size(); ++i) EXPECT_LT((places[i] - normals[i]).norm(), 1e-6);
}

TEST(BSplineSurface, FieldsOfAnyWidthAndRowsInPortions) {
  for_surfaces([](const BSplineSurface& surface, Random& random) {
    const std::vector<double> us = samples::parameters(surface.u, 6);
    const std::vector<double> vs = samples::parameters(surface.v, 5);
    const GridEvaluator grid(surface, us, vs);
    for (const std::size_t k : {1U, 2U, 3U, 5U}) {
      std::vector<double> field(k * surface.control.size());
      for (double& x : field) x = samples::uniform(random, -1, 1);
      std::vector<double> values(grid.size() * k);
      ASSERT_TRUE(grid.evaluate(field, k, values).ok());
      for (std::size_t r = 0; r < us.size(); ++r) {
        for (std::size_t c = 0; c < vs.size(); ++c) {
          const auto functional = surface_functional(surface, us[r], vs[c], 0, 0);
          for (std::size_t m = 0; m < k; ++m) {
            double expected = 0;
            for (std::size_t i = 0; i < functional->point.size(); ++i) {
              expected += functional->value[i] * field[functional->point[i] * k + m];
            }
            EXPECT_NEAR(values[(r * vs.size() + c) * k + m], expected, 1e-13);
          }
        }
      }
      // X2: the bits do not depend on the portions.
      std::vector<double> some(2 * vs.size() * k);
      ASSERT_TRUE(grid.evaluate(field, k, 3, 2, some).ok());
      EXPECT_TRUE(std::equal(some.begin(), some.end(),
                             values.begin() + static_cast<std::ptrdiff_t>(3 * vs.size() * k)));
    }
  });
}

TEST(BSplineSurface, FieldsThatDoNotFitAreRefused) {
  const BSplineSurface surface = sphere();
  const std::vector<double> us = {0, 1};
  const GridEvaluator grid(surface, us, us);
  std::vector<double> field(surface.control.size());
  std::vector<double> values(4);
  EXPECT_TRUE(grid.evaluate(field, 1, values).ok());
  EXPECT_EQ(grid.evaluate(field, 0, values).error().field, "field");
  EXPECT_EQ(grid.evaluate(field, 2, values).error().field, "field");
  EXPECT_EQ(grid.evaluate(field, 1, 1, 2, values).error().field, "rows");
  EXPECT_EQ(grid.evaluate(field, 1, 3, static_cast<std::size_t>(-1), values).error().field, "rows");
  EXPECT_EQ(grid.evaluate(field, 1, 0, 1, values).error().field, "values");
  std::vector<Vec3> places;
  BSplineSurface other = surface;
  other.control.pop_back();
  EXPECT_FALSE(grid.evaluate(other, places).ok());
}

TEST(BSplineSurface, BadNumbersAreNamed) {
  BSplineSurface surface = sphere();
  surface.control[3].y() = nan;
  EXPECT_EQ(check(surface).error().field, "control[3]");
  surface = sphere();
  surface.weights[40] = 0;
  EXPECT_EQ(check(surface).error().field, "weights[40]");
  surface = sphere();
  surface.control.clear();
  EXPECT_EQ(check(surface).error().field, "control");
  EXPECT_TRUE(sphere().evaluate(nan, nan).allFinite());
}

}  // namespace
}  // namespace handloft::geometry
