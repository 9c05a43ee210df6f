#include "server-model/geometry/superellipse.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

const Box2 sample_box{{0.03, -0.02}, {0.08, 0.05}};

double polygon_area(const std::vector<Vec2>& p) {
  double twice = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec2& a = p[i];
    const Vec2& b = p[(i + 1) % p.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

TEST(Superellipse, A22_TouchesTheBoxAtTheMiddlesOfItsSides) {
  for (const double n : {0.2, 0.5, 1.0, 2.0, 7.3, 20.0}) {
    const auto s = Superellipse::create(sample_box, n);
    ASSERT_TRUE(s.ok());
    EXPECT_NEAR(s->level({0.11, -0.02}), 1, 1e-12);
    EXPECT_NEAR(s->level({-0.05, -0.02}), 1, 1e-12);
    EXPECT_NEAR(s->level({0.03, 0.03}), 1, 1e-12);
    EXPECT_NEAR(s->level({0.03, -0.07}), 1, 1e-12);
    EXPECT_EQ(s->level({0.03, -0.02}), 0);
  }
}

TEST(Superellipse, A22_AreaOfTheEllipseAndOfTheContourPolygon) {
  EXPECT_NEAR(Superellipse::create(sample_box, 2)->area(), std::numbers::pi * 0.08 * 0.05, 1e-15);
  EXPECT_NEAR(Superellipse::create(sample_box, 1)->area(), 2 * 0.08 * 0.05, 1e-15);
  for (const double n : {0.5, 1.0, 2.0, 4.0, 20.0}) {
    const auto s = Superellipse::create(sample_box, n);
    for (const double level : {1.0, trim_level()}) {
      EXPECT_NEAR(polygon_area(s->contour(level, 400)) / s->area(level), 1, 1e-3) << n << " " << level;
    }
  }
}

TEST(Superellipse, A22_AreaBySampling) {
  // Of f <= 1, over the middles of a fine grid's cells, as many of them in y as fall together with no
  // contour.
  constexpr int columns = 800;
  constexpr int rows = 811;
  for (const double n : {0.3, 0.5, 1.0, 2.0, 4.0, 20.0}) {
    const auto s = Superellipse::create(sample_box, n);
    int inside = 0;
    for (int i = 0; i < columns; ++i) {
      for (int j = 0; j < rows; ++j) {
        const Vec2 unit((2 * i + 1.0) / columns - 1, (2 * j + 1.0) / rows - 1);
        inside += s->level(sample_box.centre + unit.cwiseProduct(sample_box.half_extent)) <= 1 ? 1 : 0;
      }
    }
    const double box_area = 4 * sample_box.half_extent.prod();
    const double expected =
        box_area * std::tgamma(1 + 1 / n) * std::tgamma(1 + 1 / n) / std::tgamma(1 + 2 / n);
    EXPECT_NEAR(box_area * inside / (columns * rows), expected, 1e-3 * box_area) << n;
    EXPECT_NEAR(s->area(), expected, 1e-12) << n;
  }
  EXPECT_NEAR(Superellipse::create(sample_box, 2)->area(), std::numbers::pi * 0.08 * 0.05, 1e-15);
}

TEST(Superellipse, A22_ContourPointsLieOnTheLevel) {
  for (const double n : {0.2, 0.5, 1.0, 1.5, 2.0, 20.0}) {
    const auto s = Superellipse::create(sample_box, n);
    // |y'|^n at the tips of a star (n < 1) turns rounding of y' into as much as its n-th power.
    const double tolerance = n < 1 ? 2e-3 : 1e-11;
    for (const Vec2& p : s->contour(visible_level(), 32))
      EXPECT_NEAR(s->level(p), visible_level(), tolerance) << n;
    for (int k = 0; k < 64; ++k)
      EXPECT_NEAR(s->level(s->contour_point(0.1 * k, 1.381)), 1.381, tolerance) << n;
  }
}

TEST(Superellipse, A22_ExponentIsClampedAndZeroSidesWidened) {
  EXPECT_EQ(Superellipse::create(sample_box, 0.01)->exponent(), 0.2);
  EXPECT_EQ(Superellipse::create(sample_box, 1e6)->exponent(), 20);
  const auto flat = Superellipse::create({{0, 0}, {0.1, 0}}, 2);
  ASSERT_TRUE(flat.ok());
  EXPECT_GT(flat->half_extent().y(), 0);
  EXPECT_TRUE(std::isfinite(flat->level({0.05, 0.01})));
  EXPECT_GT(Superellipse::create({{0, 0}, {0, 0}}, 2)->half_extent().minCoeff(), 0);
}

TEST(Superellipse, A22_BadInputIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Superellipse::create({{nan, 0}, {1, 1}}, 2).error().field, "box");
  EXPECT_EQ(Superellipse::create({{0, 0}, {1, -1}}, 2).error().field, "box");
  for (const double n : {nan, 0.0, -2.0})
    EXPECT_EQ(Superellipse::create(sample_box, n).error().field, "exponent");
}

TEST(Superellipse, A23_HandValuesOfEq7) {
  EXPECT_EQ(opacity_at_level(0), 1);
  EXPECT_NEAR(opacity_at_level(1), 0.905, 1e-3);
  EXPECT_NEAR(trim_level(), 1.381, 1e-3);
  EXPECT_NEAR(level_of_opacity(0.01), 1.893, 1e-3);
  EXPECT_NEAR(visible_level(), 1.953, 1e-3);
  EXPECT_EQ(opacity_at_level(1e300), 0);
  EXPECT_EQ(opacity_at_level(std::numeric_limits<double>::quiet_NaN()), 0);
}

TEST(Superellipse, A23_VisibleEdgeByExponent) {
  const std::array<std::pair<double, double>, 3> expected{{{2, 1.40}, {1, 1.95}, {0.5, 3.81}}};
  for (const auto& [n, edge] : expected) {
    const auto s = Superellipse::create({{0, 0}, {1, 1}}, n);
    // To the two decimals that are printed, and to the last of ours.
    EXPECT_NEAR(s->contour_half_extent(visible_level()).x(), edge, 0.005) << n;
    EXPECT_NEAR(s->contour_half_extent(visible_level()).x(), std::pow(visible_level(), 1 / n), 1e-12) << n;
  }
}

}  // namespace
}  // namespace handloft::geometry
