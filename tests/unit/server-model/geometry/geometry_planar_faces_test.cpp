#include "server-model/geometry/planar_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server-model/geometry/boundary_trim.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

double total_area(const std::vector<PlanarFace>& faces) {
  double sum = 0;
  for (const PlanarFace& face : faces) sum += face.area();
  return sum;
}

TEST(PlanarFaces, ASimplePolygonIsItselfEitherWayRound) {
  std::vector<Vec2> square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (int way = 0; way < 2; ++way) {
    const auto faces = planar_faces(square);
    ASSERT_TRUE(faces.ok());
    ASSERT_EQ(faces->size(), 1U);
    EXPECT_EQ(faces->front().outer.size(), 4U);
    EXPECT_TRUE(faces->front().holes.empty());
    EXPECT_NEAR(faces->front().area(), 1, 1e-15);
    std::reverse(square.begin(), square.end());
  }
}

TEST(PlanarFaces, A24_AFigureOfEightMakesTwo) {
  const auto faces = planar_faces(std::vector<Vec2>{{-1, -1}, {1, 1}, {1, -1}, {-1, 1}});
  ASSERT_TRUE(faces.ok());
  ASSERT_EQ(faces->size(), 2U);
  EXPECT_NEAR((*faces)[0].area(), 1, 1e-12);
  EXPECT_NEAR((*faces)[1].area(), 1, 1e-12);
}

TEST(PlanarFaces, A24_ACurlIsAHole) {
  // An outer square, and an inner one gone round the same way before the curve closes across itself.
  const std::vector<Vec2> curl{{0, 0}, {4, 0}, {4, 4}, {0, 4},  {0, 1},
                               {3, 1}, {3, 3}, {1, 3}, {1, -1}, {0, -1}};
  const auto faces = planar_faces(curl);
  ASSERT_TRUE(faces.ok());
  const auto trim = BoundaryTrim::create(curl);
  ASSERT_TRUE(trim.ok());
  constexpr int side = 600;
  int inside = 0;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      inside += trim->inside({6 * (i + 0.5) / side - 1, 6 * (j + 0.5) / side - 1.5}) ? 1 : 0;
    }
  }
  EXPECT_NEAR(total_area(*faces), inside * 36.0 / (side * side), 0.02);
}

TEST(PlanarFaces, HaveTheEvenOddAreaOfAnyScribble) {
  std::mt19937_64 random(90);
  for (int k = 0; k < 30; ++k) {
    std::vector<Vec2> scribble;
    for (int i = 0; i < 4 + k; ++i)
      scribble.emplace_back(test::uniform(random, 0, 1), test::uniform(random, 0, 1));
    const auto faces = planar_faces(scribble);
    ASSERT_TRUE(faces.ok()) << k;
    const auto trim = BoundaryTrim::create(scribble, {.max_gap_fraction = 10});
    ASSERT_TRUE(trim.ok());
    constexpr int side = 250;
    int inside = 0;
    for (int i = 0; i < side; ++i) {
      for (int j = 0; j < side; ++j) inside += trim->inside({(i + 0.5) / side, (j + 0.5) / side}) ? 1 : 0;
    }
    EXPECT_NEAR(total_area(*faces), inside / double(side * side), 0.01) << k;
    for (const PlanarFace& face : *faces) {
      EXPECT_GT(face.area(), 0);
      const auto again = planar_faces(face.outer);
      ASSERT_TRUE(again.ok());
      EXPECT_EQ(again->size(), 1U) << "a border that crosses itself";
    }
  }
}

TEST(PlanarFaces, LeavesOutWhatIsBelowTheTolerance) {
  std::vector<Vec2> circle;
  for (int i = 0; i < 5000; ++i) {
    const double angle = 2 * std::numbers::pi * i / 5000;
    circle.emplace_back(0.05 * std::cos(angle), 0.05 * std::sin(angle));
  }
  const auto faces = planar_faces(circle);
  ASSERT_TRUE(faces.ok());
  EXPECT_LT(faces->front().outer.size(), 400U);
  EXPECT_NEAR(faces->front().area(), std::numbers::pi * 0.0025, 2 * std::numbers::pi * 0.05 * 1e-5);
}

TEST(PlanarFaces, BadInputIsRefused) {
  const auto code = [](const std::vector<Vec2>& polygon, const PlanarFaceOptions& options = {}) {
    const auto faces = planar_faces(polygon, options);
    return faces.ok() ? ErrorCode::internal : faces.error().code;
  };
  EXPECT_EQ(code({}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{0, 0}, {1, 0}, {2, 0}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{0, 0}, {1, 0}, {1, 1}, {1, 0}}), ErrorCode::invalid_argument) << "there and back";
  EXPECT_EQ(code({{0, 0}, {1, std::nan("")}, {1, 1}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {.max_vertices = 3}), ErrorCode::resource_exhausted);
  std::vector<Vec2> star;
  for (int i = 0; i < 101; ++i) {
    const double angle = 2 * std::numbers::pi * 50 * i / 101;
    star.emplace_back(std::cos(angle), std::sin(angle));
  }
  EXPECT_EQ(code(star, {.max_crossings = 100}), ErrorCode::resource_exhausted);
  EXPECT_EQ(code(star), ErrorCode::internal);
}

}  // namespace
}  // namespace handloft::geometry
