#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server-model/geometry/polynomial_fit.h"
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
    EXPECT_LE(fitter.refactorisations(), 20U);  // The box settles; it's not refactored for every point.
  }
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
  EXPECT_EQ(fitter.refactorisations(), before + 1);
  EXPECT_LE(distance(fitter.solve()->surface, fit_polynomial_surface(cloud)->surface), 1e-13);
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
