// The degree by cross-validation: against leaving each point out in truth, and on surfaces whose degree is
// known.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server-model/geometry/automatic_degree.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

/// z = 0.1 (x^N + y^N and all below it) + noise over a square of 16 cm.
std::vector<WeightedPoint> noisy_surface(std::mt19937_64& random, int degree, std::size_t n, double noise_m) {
  std::vector<WeightedPoint> points = test::random_cloud(random, n, 0.08, 0.08);
  std::normal_distribution<double> normal(0, 1);
  for (WeightedPoint& p : points) {
    const double u = (p.position.x() - 0.03) / 0.08;
    const double v = (p.position.y() + 0.02) / 0.08;
    double z = 0;
    for (int k = 1; k <= degree; ++k)
      z += 0.01 * (std::pow(u, k) - 0.7 * std::pow(v, k)) + 0.004 * std::pow(u + v, k) / k;
    // The noise of a point of weight theta is taken as 1 / sqrt(theta) times as large, as the weights say.
    p.position.z() = z + noise_m * normal(random) / std::sqrt(p.weight);
  }
  return points;
}

TEST(AutomaticDegree, A4_ScoreIsThatOfLeavingEachPointOutInTruth) {
  std::mt19937_64 random(30);
  const std::vector<WeightedPoint> points = noisy_surface(random, 3, 60, 1e-3);
  const auto automatic = fit_automatic_degree(points, {.highest_degree = 4});
  ASSERT_TRUE(automatic.ok());
  ASSERT_EQ(automatic->scores.size(), 4U);
  for (int degree = 1; degree <= 4; ++degree) {
    double sum = 0;
    double weights = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::vector<WeightedPoint> others = points;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      const auto fit = fit_polynomial_surface(others, {.degree = degree});
      ASSERT_TRUE(fit.ok());
      const Vec3& p = points[i].position;
      sum += points[i].weight * std::pow(p.z() - fit->surface.value(p.x(), p.y()), 2);
      weights += points[i].weight;
    }
    const DegreeScore& score = automatic->scores[static_cast<std::size_t>(degree - 1)];
    EXPECT_EQ(score.state, DegreeScore::State::validated);
    EXPECT_NEAR(score.cross_validated_rms, std::sqrt(sum / weights), 1e-12) << degree;
    EXPECT_NEAR(score.weighted_rms,
                fit_polynomial_surface(points, {.degree = degree})->statistics.weighted_rms, 1e-14);
    EXPECT_GT(score.cross_validated_rms, score.weighted_rms);
  }
}

TEST(AutomaticDegree, A4_FindsTheDegreeOfNoisySurfaces) {
  std::mt19937_64 random(31);
  for (int degree = 1; degree <= 4; ++degree) {
    int right = 0;
    for (int round = 0; round < 20; ++round) {
      const auto points = noisy_surface(random, degree, 400, 2e-4);
      const auto automatic = fit_automatic_degree(points);
      ASSERT_TRUE(automatic.ok());
      right += automatic->fit.surface.degree() == degree ? 1 : 0;
    }
    EXPECT_GE(right, 19) << degree;
  }
}

TEST(AutomaticDegree, A4_ExactDataTakesTheLowestDegreeThatIsExact) {
  std::mt19937_64 random(32);
  for (int degree = 1; degree <= 6; ++degree) {
    const auto automatic = fit_automatic_degree(noisy_surface(random, degree, 120, 0));
    ASSERT_TRUE(automatic.ok());
    EXPECT_EQ(automatic->fit.surface.degree(), degree);
    EXPECT_LE(automatic->cross_validated_rms, 1e-13);
  }
}

TEST(AutomaticDegree, A4_JumpsOverADegreeThatGainsNothing) {
  // Even in both variables: degree 3 is no better than 2, and 4 is.
  std::mt19937_64 random(33);
  std::vector<WeightedPoint> points = test::random_cloud(random, 500, 0.08, 0.08);
  for (WeightedPoint& p : points) {
    const double u = (p.position.x() - 0.03) / 0.08;
    const double v = (p.position.y() + 0.02) / 0.08;
    p.position.z() = 0.01 * (std::pow(u, 4) + std::pow(v, 4)) + test::uniform(random, -1e-4, 1e-4);
  }
  EXPECT_EQ(fit_automatic_degree(points)->fit.surface.degree(), 4);
}

TEST(AutomaticDegree, A4_NoiseAloneIsAPlane) {
  std::mt19937_64 random(34);
  int planes = 0;
  for (int round = 0; round < 20; ++round) {
    const auto automatic = fit_automatic_degree(test::random_cloud(random, 200));
    ASSERT_TRUE(automatic.ok());
    planes += automatic->fit.surface.degree() == 1 ? 1 : 0;
  }
  EXPECT_GE(planes, 19);
}

TEST(AutomaticDegree, A7_NeverPicksWhatThePointsDontCarry) {
  // On a circle degree 2 is ambiguous, whatever the heights.
  std::vector<WeightedPoint> circle;
  for (int i = 0; i < 40; ++i) {
    circle.push_back({{std::cos(0.2 * i), std::sin(0.2 * i), std::sin(0.4 * i)}, 1.0});
  }
  const auto on_circle = fit_automatic_degree(circle);
  ASSERT_TRUE(on_circle.ok());
  EXPECT_EQ(on_circle->fit.surface.degree(), 1);
  EXPECT_EQ(on_circle->scores[1].state, DegreeScore::State::rank_deficient);
  EXPECT_EQ(on_circle->scores[5].state, DegreeScore::State::rank_deficient);
  // Six points carry degree 2, but not one of them can be spared.
  std::mt19937_64 random(35);
  const auto six = fit_automatic_degree(test::random_cloud(random, 6));
  ASSERT_TRUE(six.ok());
  EXPECT_EQ(six->fit.surface.degree(), 1);
  EXPECT_EQ(six->scores[1].state, DegreeScore::State::hangs_on_single_points);
  const auto three = fit_automatic_degree(test::random_cloud(random, 3));
  ASSERT_TRUE(three.ok());
  EXPECT_EQ(three->fit.surface.degree(), 1);
  EXPECT_EQ(three->scores[0].state, DegreeScore::State::hangs_on_single_points);
  EXPECT_EQ(three->cross_validated_rms, 0);
}

TEST(AutomaticDegree, IsTheFitOfThatDegreeToTheBit) {
  std::mt19937_64 random(36);
  for (int degree = 1; degree <= 4; ++degree) {
    const auto points = noisy_surface(random, degree, 700, 1e-4);
    const auto automatic = fit_automatic_degree(points, {.highest_degree = 4});
    ASSERT_TRUE(automatic.ok());
    const int chosen = automatic->fit.surface.degree();
    const auto plain = fit_polynomial_surface(points, {.degree = chosen});
    EXPECT_EQ(automatic->fit.surface, plain->surface);
    EXPECT_EQ(automatic->fit.requested_degree, chosen);
    EXPECT_EQ(automatic->fit.statistics.rms, plain->statistics.rms);
  }
}

TEST(AutomaticDegree, OrderAndScaleOfWeightsDontMatter) {
  std::mt19937_64 random(37);
  auto points = noisy_surface(random, 3, 300, 5e-4);
  const auto before = fit_automatic_degree(points);
  std::reverse(points.begin(), points.end());
  for (WeightedPoint& p : points) p.weight *= 0x1p-900;
  const auto after = fit_automatic_degree(points);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_EQ(after->fit.surface.degree(), before->fit.surface.degree());
  EXPECT_NEAR(after->cross_validated_rms, before->cross_validated_rms, 1e-14);
}

TEST(AutomaticDegree, X5_BadInputIsRefusedWithItsField) {
  std::mt19937_64 random(38);
  auto points = test::random_cloud(random, 20);
  EXPECT_EQ(fit_automatic_degree(points, {.highest_degree = 0}).error().field, "highest_degree");
  EXPECT_EQ(fit_automatic_degree(points, {.highest_degree = 7}).error().field, "highest_degree");
  EXPECT_EQ(fit_automatic_degree(points, {.least_gain = NAN}).error().field, "least_gain");
  EXPECT_EQ(fit_automatic_degree(points, {.least_significance = -1}).error().field, "least_significance");
  EXPECT_EQ(fit_automatic_degree(points, {.negligible_rms = 2}).error().field, "negligible_rms");
  EXPECT_EQ(fit_automatic_degree({}).error().code, ErrorCode::rank_deficient);
  points[4].weight = NAN;
  EXPECT_EQ(fit_automatic_degree(points).error().field, "points[4].weight");
  for (const double size : {1e-200, 1e-30, 1e30, 1e99}) {
    auto absurd = test::random_cloud(random, 60);
    for (WeightedPoint& p : absurd) p.position *= size;
    const auto fit = fit_automatic_degree(absurd);
    if (fit.ok()) {
      EXPECT_TRUE(std::isfinite(fit->cross_validated_rms)) << size;
    }
  }
}

}  // namespace
}  // namespace handloft::geometry
