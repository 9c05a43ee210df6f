#include "server-model/geometry/bezier_patch.h"

#include <gtest/gtest.h>

#include <limits>

#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

TEST(BezierPatch, A26_IsExactlyThePolynomial) {
  std::mt19937_64 random(50);
  for (int degree = min_degree; degree <= max_degree; ++degree) {
    const PolynomialSurface surface = test::random_surface(random, degree, {{0.03, -0.02}, {0.08, 0.05}});
    const Frame frame = test::random_frame(random);
    const Box2 box{{0.02, -0.01}, {0.1, 0.06}};
    const auto patch = to_bezier_patch(surface, frame, box);
    ASSERT_TRUE(patch.ok());
    EXPECT_EQ(patch->control.size(), static_cast<std::size_t>((degree + 1) * (degree + 1)));
    for (int i = 0; i < 100; ++i) {
      const double u = test::uniform(random, 0, 1);
      const double v = test::uniform(random, 0, 1);
      const Vec2 xy = box.lower() + 2 * Vec2(u, v).cwiseProduct(box.half_extent);
      EXPECT_LE((patch->evaluate(u, v) - surface.world_point(frame, xy.x(), xy.y())).norm(), 1e-13);
    }
  }
}

TEST(BezierPatch, ParaboloidByHand) {
  // z = x^2 over [-1, 1]: ordinates 1, -1, 1.
  const auto surface = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 1., 0.});
  const auto patch = to_bezier_patch(*surface, Frame{}, {{0, 0}, {1, 1}});
  ASSERT_TRUE(patch.ok());
  EXPECT_EQ(patch->at(0, 0), Vec3(-1, -1, 1));
  EXPECT_EQ(patch->at(1, 0), Vec3(0, -1, -1));
  EXPECT_EQ(patch->at(2, 2), Vec3(1, 1, 1));
}

TEST(BezierPatch, EmptyBoxIsRefused) {
  EXPECT_EQ(to_bezier_patch({}, {}, {{0, 0}, {0, 1}}).error().field, "box");
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(to_bezier_patch({}, {}, {{0, 0}, {inf, 1}}).error().field, "box");
}

}  // namespace
}  // namespace handloft::geometry
