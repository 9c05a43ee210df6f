#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "server-model/geometry/surface_pick.h"
#include "test_surfaces.h"
#include "tests/support/build_kind.h"

namespace handloft::geometry {
namespace {

TrimField ellipse(double n = 2) {
  return *Superellipse::create({{0.01, 0.0}, {0.06, 0.04}}, n);
}
/// A ring: the middle isn't there.
TrimField ring() {
  std::vector<Vec2> curve;
  for (const double radius : {0.06, 0.03}) {
    for (int i = 0; i <= 100; ++i) {
      const double angle = 2 * std::numbers::pi * i / 100;
      curve.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
  }
  return std::make_shared<const BoundaryTrim>(*BoundaryTrim::create(curve));
}
PolynomialSurface dome() {
  return *PolynomialSurface::from_coefficients(2, std::array{0.02, 0., 0., 0.5, -2., -4.});
}
PolynomialSurface flat() {
  return *PolynomialSurface::from_coefficients(1, std::array{0., 0., 0.});
}

TEST(Pick, HitsWhatARayIsAimedAt) {
  std::mt19937_64 random(70);
  for (int degree = 1; degree <= 6; ++degree) {
    for (int k = 0; k < 60; ++k) {
      const Frame frame = test::random_frame(random);
      const PolynomialSurface surface = test::random_surface(random, degree, {{0.01, 0}, {0.06, 0.04}});
      const TrimField trim = ellipse(test::uniform(random, 0.5, 6));
      const Vec2 xy(0.01 + test::uniform(random, -0.06, 0.06), test::uniform(random, -0.04, 0.04));
      if (!trim.solid(xy)) continue;
      const Vec3 target = surface.world_point(frame, xy.x(), xy.y());
      const Vec3 eye = target + 0.4 * Vec3(test::uniform(random, -1, 1), test::uniform(random, -1, 1),
                                           test::uniform(random, -1, 1));
      const auto hit = pick_surface(surface, frame, trim, eye, 7 * (target - eye));
      ASSERT_TRUE(hit.has_value());
      // It may be met earlier, but never later.
      EXPECT_LE(hit->distance_m, (target - eye).norm() + 1e-9);
      EXPECT_NEAR((eye + hit->distance_m * (target - eye).normalized() - hit->position).norm(), 0, 1e-11);
      EXPECT_TRUE(trim.solid(hit->xy));
      EXPECT_NEAR(frame.to_local(hit->position).z(), surface.value(hit->xy.x(), hit->xy.y()), 1e-12);
      EXPECT_NEAR(hit->normal.norm(), 1, 1e-12);
    }
  }
}

TEST(Pick, IsTheFirstByDenseSampling) {
  std::mt19937_64 random(71);
  int several = 0;
  const TrimField oval = ellipse(3), loop = ring();
  for (int k = 0; k < 100; ++k) {
    const PolynomialSurface surface = test::random_surface(random, 6, {{0.01, 0}, {0.06, 0.04}}, 0.02);
    const TrimField& trim = k % 2 == 0 ? oval : loop;
    std::array<double, 4> u{};  // One by one: the order of arguments is the compiler's own.
    for (double& value : u) value = test::uniform(random, -1, 1);
    const Vec3 eye(-0.2, 0.05 * u[0], 0.03 * u[1]);
    const Vec3 way = Vec3(1, 0.2 * u[2], 0.1 * u[3]).normalized();
    double expected = -1;
    int crossings = 0;
    constexpr int steps = 1000;
    double before = 0;
    bool solid_before = false;
    bool at_the_border = false;
    for (int i = 0; i <= steps; ++i) {
      const double t = 0.5 * i / steps;
      const Vec3 p = eye + t * way;
      const double height = surface.value(p.x(), p.y()) - p.z();
      const bool solid = trim.solid(p.head<2>());
      if (i > 0 && (height < 0) != (before < 0)) {
        at_the_border = at_the_border || solid != solid_before;
        if (solid) ++crossings;
        if (solid && expected < 0) expected = t;
      }
      before = height;
      solid_before = solid;
    }
    if (at_the_border) continue;  // Too near to call by samples.
    several += crossings > 1 ? 1 : 0;
    const auto hit = pick_surface(surface, Frame{}, trim, eye, way);
    ASSERT_EQ(hit.has_value(), expected >= 0) << k;
    if (hit) {
      EXPECT_NEAR(hit->distance_m, expected, 6e-4);
    }
  }
  EXPECT_GT(several, 4) << "the test is about rays that meet the surface more than once";
}

TEST(Pick, A22_A24_RespectsTheTrim) {
  const auto down = [](const TrimField& trim, double x, double y) {
    return pick_surface(flat(), Frame{}, trim, {x, y, 1}, {0, 0, -1});
  };
  const double edge = 0.01 + 0.06 * std::sqrt(trim_level());
  EXPECT_TRUE(down(ellipse(), edge - 1e-6, 0));
  EXPECT_FALSE(down(ellipse(), edge + 1e-6, 0)) << "seen, but fainter than a half";
  EXPECT_GT(ellipse().opacity({edge + 1e-3, 0}), 0.3);
  EXPECT_FALSE(down(ring(), 0, 0));
  EXPECT_TRUE(down(ring(), 0.045, 0));
  // From below the hole of a bowl onto its wall.
  const auto bowl = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 20., 20.});
  const auto far = pick_surface(*bowl, Frame{}, ring(), {0, 0, -1}, {0.04, 0, 1 + 20 * 0.04 * 0.04});
  ASSERT_TRUE(far);
  EXPECT_NEAR(far->xy.x(), 0.04, 1e-12);
}

TEST(Pick, GrazesFlushesAndMisses) {
  const auto bowl = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 1., 1.});
  const auto graze = pick_surface(*bowl, Frame{}, ellipse(), {-1, 0, 0}, {1, 0, 0});
  ASSERT_TRUE(graze) << "touched from below at the bottom";
  EXPECT_NEAR(graze->xy.x(), 0, 1e-6);
  EXPECT_FALSE(pick_surface(*bowl, Frame{}, ellipse(), {-1, 0, -1e-6}, {1, 0, 0}));
  const auto flush = pick_surface(flat(), Frame{}, ellipse(), {-1, 0, 0}, {1, 0, 0});
  ASSERT_TRUE(flush) << "a ray within the plane meets its border";
  EXPECT_NEAR(flush->xy.x(), 0.01 - 0.06 * std::sqrt(trim_level()), 1e-3);
  EXPECT_FALSE(pick_surface(flat(), Frame{}, ellipse(), {0, 0, 1}, {0, 0, 1})) << "behind";
  EXPECT_FALSE(pick_surface(flat(), Frame{}, ellipse(), {0, 0, 1}, {0, 0, 0}));
  EXPECT_FALSE(pick_surface(flat(), Frame{}, ellipse(), {0, 0, std::nan("")}, {0, 0, -1}));
  EXPECT_FALSE(
      pick_surface(flat(), Frame{}, ellipse(), {0, 0, 1}, {0, 0, -std::numeric_limits<double>::infinity()}));
  EXPECT_TRUE(pick_surface(flat(), Frame{}, ellipse(), {0, 0, 1}, {0, 0, -1e-200}));
}

TEST(Nearest, IsTheFootOfTheNormalToRounding) {
  std::mt19937_64 random(72);
  for (int k = 0; k < 100; ++k) {
    const Frame frame = test::random_frame(random);
    const PolynomialSurface surface =
        k % 2 == 0 ? dome() : test::random_surface(random, 4, {{0.01, 0}, {0.06, 0.04}}, 0.004);
    const TrimField trim = ellipse();
    const Vec2 xy(0.01 + test::uniform(random, -0.04, 0.04), test::uniform(random, -0.025, 0.025));
    const Vec3 foot = surface.world_point(frame, xy.x(), xy.y());
    const double height = test::uniform(random, -0.003, 0.003);
    const auto near = nearest_solid_place(surface, frame, trim,
                                          foot + height * surface.world_normal(frame, xy.x(), xy.y()));
    ASSERT_TRUE(near);
    EXPECT_LE(near->distance_m, std::abs(height) + 1e-14);
    EXPECT_NEAR((near->position - foot).norm(), 0, 1e-9);
  }
}

TEST(Nearest, NoSampledPlaceIsNearer) {
  std::mt19937_64 random(73);
  constexpr int surfaces = handloft::test::sanitized ? 9 : 60;
  for (int k = 0; k < surfaces; ++k) {
    const PolynomialSurface surface = test::random_surface(random, 6, {{0.01, 0}, {0.06, 0.04}}, 0.01);
    const TrimField trim = k % 3 == 0 ? ring() : ellipse(k % 3 == 1 ? 0.7 : 5);
    const Vec3 p(test::uniform(random, -0.2, 0.2), test::uniform(random, -0.2, 0.2),
                 test::uniform(random, -0.1, 0.1));
    double best = 1e300;
    const Box2 box = trim.solid_box();
    for (int i = 0; i <= 60; ++i) {
      for (int j = 0; j <= 60; ++j) {
        const Vec2 xy = box.lower() + Vec2(i, j).cwiseProduct(box.half_extent) / 30;
        if (trim.solid(xy)) best = std::min(best, (surface.point(xy.x(), xy.y()) - p).norm());
      }
    }
    const auto near = nearest_solid_place(surface, Frame{}, trim, p);
    ASSERT_TRUE(near);
    EXPECT_LE(near->distance_m, best + 1e-6) << k;
    EXPECT_GE(trim.opacity(near->xy), solid_opacity - 1e-9);
  }
}

TEST(Nearest, A24_EndsAtTheContour) {
  const auto near = nearest_solid_place(flat(), Frame{}, ring(), {0.2, 0, 0});
  ASSERT_TRUE(near);
  EXPECT_NEAR(near->distance_m, 0.14, 1e-12);
  const auto inner = nearest_solid_place(flat(), Frame{}, ring(), {0.001, 0, 0});
  ASSERT_TRUE(inner);
  EXPECT_NEAR(inner->distance_m, 0.029, 2e-5) << "over the hole: its rim";
  EXPECT_FALSE(nearest_solid_place(flat(), Frame{}, ring(), {std::nan(""), 0, 0}));
}

}  // namespace
}  // namespace handloft::geometry
