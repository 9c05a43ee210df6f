#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server-model/geometry/polynomial_fitter.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

/// Largest distance of two surfaces over their common region, metres.
double distance(const PolynomialSurface& a, const PolynomialSurface& b) {
  double largest = 0;
  for (int i = -5; i <= 5; ++i) {
    for (int j = -5; j <= 5; ++j) {
      const double x = 0.03 + 0.016 * i;
      const double y = -0.02 + 0.01 * j;
      largest = std::max(largest, std::abs(a.value(x, y) - b.value(x, y)));
    }
  }
  return largest;
}

TEST(PolynomialFitter, A27_AddingOneByOneIsTheFitOfAll) {
  std::mt19937_64 random(20);
  for (const int degree : {1, 2, 4}) {
    const std::vector<WeightedPoint> cloud = test::random_cloud(random, 300);
    PolynomialFitter fitter({.degree = degree});
    for (const WeightedPoint& p : cloud) ASSERT_TRUE(fitter.add(p).ok());
    const auto live = fitter.solve();
    const auto whole = fit_polynomial_surface(cloud, {.degree = degree});
    ASSERT_TRUE(live.ok() && whole.ok());
    EXPECT_LE(distance(live->surface, whole->surface), 1e-12);
    EXPECT_NEAR(live->statistics.weighted_rms, whole->statistics.weighted_rms, 1e-12);
    EXPECT_EQ(live->statistics.count, 300U);
    EXPECT_EQ(fitter.refactorisations(), 0U);  // Growth transforms R; the points are not touched.
    EXPECT_LE(fitter.growths(), 20U);          // And the box settles.
  }
}

TEST(PolynomialFitter, A6_PointsOfNoWeightDoNotStretchTheBox) {
  std::mt19937_64 random(18);
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 100);
  const auto without = fit_polynomial_surface(cloud, {.degree = 6});
  ASSERT_TRUE(without.ok());
  const WeightedPoint far{{30, -15, 2}, 0};
  const auto expect_same = [&](PolynomialFitter& fitter) {
    const auto fit = fitter.solve();
    ASSERT_TRUE(fit.ok()) << fit.error().describe();
    EXPECT_LE(fit->surface.box().half_extent.maxCoeff(), 2 * without->surface.box().half_extent.maxCoeff());
    EXPECT_LE(distance(fit->surface, without->surface), 1e-11);
  };
  PolynomialFitter one_by_one({.degree = 6});
  ASSERT_TRUE(one_by_one.add(far).ok());
  for (const WeightedPoint& p : cloud) ASSERT_TRUE(one_by_one.add(p).ok());
  ASSERT_TRUE(one_by_one.add(far).ok());
  expect_same(one_by_one);

  PolynomialFitter at_once({.degree = 6});
  ASSERT_TRUE(at_once.add(std::vector<WeightedPoint>(3, far)).ok());
  ASSERT_TRUE(at_once.add(cloud).ok());
  ASSERT_TRUE(at_once.add(std::vector<WeightedPoint>(2, far)).ok());
  expect_same(at_once);

  // All that pull leave, and others come where the first ones were not.
  PolynomialFitter again({.degree = 6});
  ASSERT_TRUE(again.add(far).ok());
  const auto pulling = again.add(WeightedPoint{{20, 20, 0}, 1});
  ASSERT_TRUE(pulling.ok());
  ASSERT_TRUE(again.remove(*pulling).ok());
  for (const WeightedPoint& p : cloud) ASSERT_TRUE(again.add(p).ok());
  expect_same(again);
}

TEST(PolynomialFitter, A27_RemovingIsTheFitOfTheRest) {
  std::mt19937_64 random(21);
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 300);
  PolynomialFitter fitter({.degree = 3});
  ASSERT_TRUE(fitter.add(cloud).ok());
  for (std::size_t i = 0; i < 200; ++i) ASSERT_TRUE(fitter.remove(i).ok());
  const auto live = fitter.solve();
  const auto rest = fit_polynomial_surface(std::span(cloud).subspan(200), {.degree = 3});
  ASSERT_TRUE(live.ok() && rest.ok());
  EXPECT_LE(distance(live->surface, rest->surface), 1e-11);
  EXPECT_NEAR(live->statistics.weighted_rms, rest->statistics.weighted_rms, 1e-9);
}

TEST(PolynomialFitter, A27_IllConditionedRemovalRefactorsAndStaysExact) {
  std::mt19937_64 random(22);
  PolynomialFitter fitter({.degree = 2});
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 30);
  ASSERT_TRUE(fitter.add(cloud).ok());
  // One point so heavy that all the rest vanishes beside it: taking it out by downdating loses every digit.
  const auto heavy = fitter.add({{0.03, -0.02, 1.0}, 1e14});
  ASSERT_TRUE(heavy.ok());
  const std::size_t before = fitter.refactorisations();
  ASSERT_TRUE(fitter.remove(*heavy).ok());
  EXPECT_LE(distance(fitter.solve()->surface, fit_polynomial_surface(cloud)->surface), 1e-13);
  EXPECT_EQ(fitter.refactorisations(), before + 1);
}

/// Heights of the surface over which the next tests draw, metres.
double dome(double x, double y) {
  return 0.02 + 0.1 * x - 2 * x * x + 3 * x * y - 4 * y * y + 20 * x * x * x;
}

TEST(PolynomialFitter, A27_ABoxGrownAThousandfoldIsAsGoodAsTheFitOfAll) {
  // A stroke that starts with 0.1 mm and spirals out to 10 cm: the box grows many times.
  PolynomialFitter fitter({.degree = 6});
  std::vector<WeightedPoint> points;
  std::mt19937_64 random(24);
  for (int i = 0; i < 2000; ++i) {
    const double radius = 1e-4 * std::pow(1000.0, i / 1999.0);
    const double x = 0.3 + radius * std::cos(0.7 * i);
    const double y = -0.2 + radius * std::sin(0.7 * i);
    points.push_back(
        {{x, y, dome(x, y) + test::uniform(random, -1e-3, 1e-3)}, test::uniform(random, 0.1, 1)});
    ASSERT_TRUE(fitter.add(points.back()).ok());
  }
  EXPECT_EQ(fitter.refactorisations(), 0U);
  EXPECT_GE(fitter.growths(), 8U);
  const auto live = fitter.solve();
  const auto whole = fit_polynomial_surface(points, {.degree = 6});
  ASSERT_TRUE(live.ok() && whole.ok());
  ASSERT_EQ(live->surface.degree(), 6);
  for (const WeightedPoint& p : points) {
    EXPECT_NEAR(live->surface.value(p.position.x(), p.position.y()),
                whole->surface.value(p.position.x(), p.position.y()), 1e-12);
  }
  EXPECT_NEAR(live->statistics.weighted_rms, whole->statistics.weighted_rms, 1e-13);
}

TEST(PolynomialFitter, A27_HoldingStillThenDrawingLosesNothing) {
  // A hand that presses at one place before it moves: the box begins as a point.
  PolynomialFitter fitter({.degree = 4});
  std::vector<WeightedPoint> points(50, WeightedPoint{{0.3, 0.1, dome(0.3, 0.1)}, 1.0});
  std::mt19937_64 random(25);
  for (int i = 0; i < 200; ++i) {
    const double x = 0.3 + test::uniform(random, -0.05, 0.05);
    const double y = 0.1 + test::uniform(random, -0.03, 0.03);
    points.push_back({{x, y, dome(x, y)}, 1.0});
  }
  for (const WeightedPoint& p : points) ASSERT_TRUE(fitter.add(p).ok());
  const auto live = fitter.solve();
  ASSERT_TRUE(live.ok());
  ASSERT_EQ(live->surface.degree(), 4);
  for (const WeightedPoint& p : points) {
    EXPECT_NEAR(live->surface.value(p.position.x(), p.position.y()), p.position.z(), 1e-13);
  }
}

TEST(PolynomialFitter, A7_ALineIsRefusedHoweverTheBoxGrew) {
  PolynomialFitter fitter({.degree = 2});
  for (int i = 0; i < 100; ++i) {  // Along x to within rounding: y wanders by an ulp.
    ASSERT_TRUE(fitter.add(WeightedPoint{{0.001 * i, 0.2 + (i % 3) * 0x1p-55, 0.01 * i}, 1.0}).ok());
  }
  EXPECT_EQ(fitter.solve().error().code, ErrorCode::rank_deficient);
  // One point beside it, and the plane is there.
  ASSERT_TRUE(fitter.add(WeightedPoint{{0, 0.25, 0}, 1.0}).ok());
  const auto plane = fitter.solve();
  ASSERT_TRUE(plane.ok());
  EXPECT_EQ(plane->surface.degree(), 1);
  EXPECT_TRUE(plane->degree_reduced());
}

TEST(PolynomialFitter, A27_RemovedPlacesAreUsedAgain) {
  std::mt19937_64 random(26);
  PolynomialFitter fitter;
  ASSERT_TRUE(fitter.add(test::random_cloud(random, 500)).ok());
  const std::size_t capacity = fitter.capacity();
  // A window that slides for long: as many come as go.
  std::vector<PolynomialFitter::Slot> slots(500);
  for (std::size_t i = 0; i < slots.size(); ++i) slots[i] = i;
  std::vector<WeightedPoint> window;
  for (int round = 0; round < 20; ++round) {
    const std::vector<WeightedPoint> next = test::random_cloud(random, 500);
    for (std::size_t i = 0; i < next.size(); ++i) {
      ASSERT_TRUE(fitter.remove(slots[i]).ok());
      slots[i] = *fitter.add(next[i]);
    }
    window = next;
  }
  EXPECT_EQ(fitter.size(), 500U);
  EXPECT_EQ(fitter.capacity(), capacity);
  EXPECT_LE(distance(fitter.solve()->surface, fit_polynomial_surface(window)->surface), 1e-12);
  EXPECT_LE(fitter.refactorisations(), 30U);  // One for each full turn of the window, not for each point.
}

TEST(PolynomialFitter, A27_ManyRemovalsThatEachLoseLittleRefactorBeforeTheySpoilTheFit) {
  // Weights fall by half from point to point: each removal halves what R holds, and no single one is bad.
  std::mt19937_64 random(27);
  std::vector<WeightedPoint> heavy = test::random_cloud(random, 60);
  for (std::size_t i = 0; i < heavy.size(); ++i) heavy[i].weight = std::ldexp(1.0, 60 - static_cast<int>(i));
  const std::vector<WeightedPoint> rest = test::random_cloud(random, 100);
  PolynomialFitter fitter;
  for (const WeightedPoint& p : heavy) ASSERT_TRUE(fitter.add(p).ok());
  for (const WeightedPoint& p : rest) ASSERT_TRUE(fitter.add(p).ok());
  for (std::size_t i = 0; i < heavy.size(); ++i) ASSERT_TRUE(fitter.remove(i).ok());
  EXPECT_LE(distance(fitter.solve()->surface, fit_polynomial_surface(rest)->surface), 1e-11);
  EXPECT_GE(fitter.refactorisations(), 1U);
}

TEST(PolynomialFitter, A27_ManyAtOnceJoinALiveFit) {
  std::mt19937_64 random(28);
  std::vector<WeightedPoint> cloud = test::random_cloud(random, 400);
  PolynomialFitter fitter({.degree = 3});
  ASSERT_TRUE(fitter.add(cloud).ok());
  const std::vector<WeightedPoint> more = test::random_cloud(random, 100, 0.2, 0.15);
  const auto first = fitter.add(more);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(*first, 400U);
  EXPECT_EQ(fitter.refactorisations(), 1U);
  cloud.insert(cloud.end(), more.begin(), more.end());
  EXPECT_LE(distance(fitter.solve()->surface, fit_polynomial_surface(cloud, {.degree = 3})->surface), 1e-12);
}

TEST(PolynomialFitter, RemovingAllThenAddingAgainWorks) {
  std::mt19937_64 random(23);
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 40);
  PolynomialFitter fitter;
  ASSERT_TRUE(fitter.add(cloud).ok());
  for (std::size_t i = 0; i < cloud.size(); ++i) ASSERT_TRUE(fitter.remove(i).ok());
  EXPECT_EQ(fitter.size(), 0U);
  EXPECT_EQ(fitter.solve().error().code, ErrorCode::rank_deficient);
  for (const WeightedPoint& p : cloud) ASSERT_TRUE(fitter.add(p).ok());
  EXPECT_LE(distance(fitter.solve()->surface, fit_polynomial_surface(cloud)->surface), 1e-12);
}

TEST(PolynomialFitter, BadInputChangesNothing) {
  PolynomialFitter fitter;
  EXPECT_EQ(fitter.add({{0, 0, NAN}, 1}).error().field, "point.position");
  EXPECT_EQ(fitter.add({{0, 0, 0}, -1}).error().field, "point.weight");
  EXPECT_EQ(fitter.remove(0).error().code, ErrorCode::not_found);
  EXPECT_EQ(fitter.size(), 0U);
  ASSERT_TRUE(fitter.add({{0, 0, 0}, 1}).ok());
  ASSERT_TRUE(fitter.remove(0).ok());
  EXPECT_EQ(fitter.remove(0).error().code, ErrorCode::not_found);
  EXPECT_EQ(PolynomialFitter({.degree = 9}).solve().error().field, "degree");
}

}  // namespace
}  // namespace handloft::geometry
