#include "server-model/geometry/symmetry.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "server-model/geometry/polynomial_fit.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

TEST(Symmetry, A12_ByHandAndTwiceIsTheIdentity) {
  const auto plane = make_plane({1, 0, 0}, {2, 0, 0});
  ASSERT_TRUE(plane.ok());
  EXPECT_EQ(reflect_point({3, 4, 5}, *plane), Vec3(-1, 4, 5));
  std::mt19937_64 random(40);
  for (int i = 0; i < 100; ++i) {
    const Frame f = test::random_frame(random);
    const Plane mirror = f.base_plane();
    // In a box whose diagonal is the unit.
    const Vec3 p =
        Vec3(test::uniform(random, -1, 1), test::uniform(random, -1, 1), test::uniform(random, -1, 1)) /
        std::sqrt(12.0);
    EXPECT_LE((reflect_point(reflect_point(p, mirror), mirror) - p).norm(), 1e-15 * (1 + p.norm()));
  }
}

TEST(Symmetry, A12_FitsOfBothSidesAreMirrorImages) {
  std::mt19937_64 random(41);
  const Plane mirror = test::random_frame(random).base_plane();
  const Frame frame = test::random_frame(random);
  const Frame mirrored_frame = reflect_frame(frame, mirror);
  EXPECT_NEAR(mirrored_frame.rotation.determinant(), 1, 1e-12);
  std::vector<WeightedPoint> left = test::random_cloud(random, 200);
  for (WeightedPoint& p : left) p.position = frame.to_world(p.position);
  std::vector<WeightedPoint> right = left;
  for (WeightedPoint& p : right) p.position = reflect_point(p.position, mirror);
  const auto a = fit_polynomial_surface(left, frame, {.degree = 3});
  const auto b = fit_polynomial_surface(right, mirrored_frame, {.degree = 3});
  ASSERT_TRUE(a.ok() && b.ok());
  const PolynomialSurface expected = a->surface.flipped_y();
  for (int i = 0; i < 50; ++i) {
    const double x = 0.03 + test::uniform(random, -0.08, 0.08);
    const double y = -0.02 + test::uniform(random, -0.05, 0.05);
    const Vec3 image = reflect_point(a->surface.world_point(frame, x, y), mirror);
    EXPECT_LE((b->surface.world_point(mirrored_frame, x, -y) - image).norm(), 1e-12);
    EXPECT_NEAR(expected.value(x, -y), a->surface.value(x, y), 1e-15);
  }
}

TEST(Symmetry, BadPlanesAreRefused) {
  EXPECT_EQ(make_plane({0, 0, 0}, {0, 0, 0}).error().field, "normal");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(make_plane({nan, 0, 0}, {0, 0, 1}).error().field, "origin");
  EXPECT_EQ(make_plane({0, 0, 0}, {0, nan, 1}).error().field, "normal");
  EXPECT_NEAR(make_plane({0, 0, 0}, {0, 0, 1e-200})->normal.z(), 1, 1e-12);
}

}  // namespace
}  // namespace handloft::geometry
