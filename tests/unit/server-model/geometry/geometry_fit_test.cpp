#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server-model/geometry/polynomial_fit.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

std::vector<WeightedPoint> on_surface(const PolynomialSurface& surface, std::vector<WeightedPoint> points) {
  for (WeightedPoint& p : points) p.position.z() = surface.value(p.position.x(), p.position.y());
  return points;
}

double largest_relative_difference(std::span<const double> found, std::span<const double> expected) {
  double difference = 0;
  double scale = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    difference = std::max(difference, std::abs(found[i] - expected[i]));
    scale = std::max(scale, std::abs(expected[i]));
  }
  return difference / scale;
}

TEST(PolynomialFit, A4_RecoversRandomCoefficientsFromTwiceAsManyPoints) {
  std::mt19937_64 random(10);
  for (int degree = 1; degree <= 4; ++degree) {
    for (int round = 0; round < 50; ++round) {
      const auto n = static_cast<std::size_t>(2 * coefficient_count(degree) + 4);
      std::vector<double> a(static_cast<std::size_t>(coefficient_count(degree)));
      for (double& c : a) c = test::uniform(random, -1, 1);
      std::vector<WeightedPoint> cloud = test::random_cloud(random, n, 1, 1);
      for (WeightedPoint& p : cloud) p.position.head<2>() -= Vec2(0.03, -0.02);
      const auto truth = PolynomialSurface::from_coefficients(degree, a);
      const auto fit = fit_polynomial_surface(on_surface(*truth, cloud), {.degree = degree});
      ASSERT_TRUE(fit.ok());
      ASSERT_EQ(fit->surface.degree(), degree);
      EXPECT_LE(largest_relative_difference(fit->surface.coefficients(), a), 1e-12);
    }
  }
}

TEST(PolynomialFit, A6_GradientOfTheWeightedSumVanishes) {
  std::mt19937_64 random(11);
  for (const int degree : {1, 2, 3, 4, 5, 6}) {
    const std::vector<WeightedPoint> cloud = test::random_cloud(random, 500);
    const auto fit = fit_polynomial_surface(cloud, {.degree = degree});
    ASSERT_TRUE(fit.ok());
    std::vector<double> gradient(static_cast<std::size_t>(coefficient_count(degree)), 0.0);
    std::vector<double> row(gradient.size());
    double phi = 0;
    const Box2& box = fit->surface.box();
    for (const WeightedPoint& p : cloud) {
      const Vec2 uv = (p.position.head<2>() - box.centre).cwiseQuotient(box.half_extent);
      evaluate_monomials(degree, uv.x(), uv.y(), row.data());
      const double r = fit->surface.value(p.position.x(), p.position.y()) - p.position.z();
      for (std::size_t k = 0; k < row.size(); ++k) {
        gradient[k] += row[k] * p.weight * r;
        phi += row[k] * row[k];
      }
    }
    for (const double g : gradient) EXPECT_LE(std::abs(g), 1e-12 * std::sqrt(phi));
  }
}

TEST(PolynomialFit, A6_TheWeightIsPressureAndNotItsSquare) {
  // A constant between heights 0 (weight 1) and 1 (weight 0.5) on each of three places: 0.5 / 1.5 = 1/3.
  std::vector<WeightedPoint> points;
  for (const Vec2& xy : {Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)}) {
    points.push_back({{xy.x(), xy.y(), 0}, 1.0});
    points.push_back({{xy.x(), xy.y(), 1}, 0.5});
  }
  const auto fit = fit_polynomial_surface(points, {.degree = 1});
  ASSERT_TRUE(fit.ok());
  EXPECT_NEAR(fit->surface.value(0.2, 0.3), 1.0 / 3, 1e-15);
}

TEST(PolynomialFit, A6_PointsOfNoWeightDoNotStretchTheBox) {
  // One lies 300 times as far away as the others: in a box that held it, they would be one corner.
  std::mt19937_64 random(18);
  for (const int degree : {1, 2, 4, 6}) {
    std::vector<WeightedPoint> cloud = test::random_cloud(random, 100);
    const auto without = fit_polynomial_surface(cloud, {.degree = degree});
    cloud.insert(cloud.begin() + 7, {{30, -15, 2}, 0});
    cloud.push_back({{-0.5, 0.1, 9}, 0});
    const auto with = fit_polynomial_surface(cloud, {.degree = degree});
    ASSERT_TRUE(without.ok() && with.ok());
    EXPECT_EQ(with->surface.box().centre, without->surface.box().centre);
    EXPECT_EQ(with->surface.box().half_extent, without->surface.box().half_extent);
    EXPECT_LE(largest_relative_difference(with->surface.scaled_coefficients(),
                                          without->surface.scaled_coefficients()),
              1e-13)
        << degree;
    EXPECT_EQ(with->statistics.count, 102U);
    EXPECT_GE(with->statistics.max, 1);  // They are still points of the shape.
  }
}

TEST(PolynomialFit, StatisticsByHand) {
  // The plane z = 0 against heights +-1 in alternation, weights 1: every residual is 1.
  const std::vector<WeightedPoint> points{
      {{0, 0, 1}, 1}, {{1, 0, -1}, 1}, {{1, 1, 1}, 1}, {{0, 1, -1}, 1}, {{0.5, 0.5, 0}, 0}};
  const auto fit = fit_polynomial_surface(points, {.degree = 1});
  ASSERT_TRUE(fit.ok());
  EXPECT_EQ(fit->statistics.count, 5U);
  EXPECT_NEAR(fit->statistics.rms, std::sqrt(4.0 / 5), 1e-15);
  EXPECT_NEAR(fit->statistics.weighted_rms, 1, 1e-15);
  EXPECT_NEAR(fit->statistics.max, 1, 1e-15);
}

TEST(PolynomialFit, A7_FivePointsDropFromDegree2ToAPlane) {
  std::mt19937_64 random(12);
  const auto fit = fit_polynomial_surface(test::random_cloud(random, 5), {.degree = 2});
  ASSERT_TRUE(fit.ok());
  EXPECT_EQ(fit->surface.degree(), 1);
  EXPECT_EQ(fit->requested_degree, 2);
  EXPECT_TRUE(fit->degree_reduced());
}

TEST(PolynomialFit, A7_CollinearFootprintIsRefused) {
  std::vector<WeightedPoint> line;
  for (int i = 0; i < 100; ++i) line.push_back({{0.001 * i, 0.002 * i + 0.3, std::sin(0.1 * i)}, 1.0});
  const auto fit = fit_polynomial_surface(line);
  ASSERT_FALSE(fit.ok());
  EXPECT_EQ(fit.error().code, ErrorCode::rank_deficient);
  EXPECT_EQ(fit.error().field, "points");
}

TEST(PolynomialFit, A7_PointsOnAConicCarryOnlyAPlane) {
  std::vector<WeightedPoint> circle;  // x^2 + y^2 = const: degree 2 is ambiguous, degree 1 isn't.
  for (int i = 0; i < 40; ++i) circle.push_back({{std::cos(0.2 * i), std::sin(0.2 * i), 0.1 * i}, 1.0});
  const auto fit = fit_polynomial_surface(circle, {.degree = 2});
  ASSERT_TRUE(fit.ok());
  EXPECT_EQ(fit->surface.degree(), 1);
}

TEST(PolynomialFit, A7_AllWeightsZeroIsRefused) {
  std::mt19937_64 random(13);
  std::vector<WeightedPoint> cloud = test::random_cloud(random, 50);
  for (WeightedPoint& p : cloud) p.weight = 0;
  EXPECT_EQ(fit_polynomial_surface(cloud).error().code, ErrorCode::rank_deficient);
}

TEST(PolynomialFit, A7_DuplicatePoints) {
  const std::vector<WeightedPoint> same(100, WeightedPoint{{0.1, 0.2, 0.3}, 1.0});
  EXPECT_EQ(fit_polynomial_surface(same).error().code, ErrorCode::rank_deficient);
  // Three places, many times: a plane.
  std::vector<WeightedPoint> three;
  for (int i = 0; i < 30; ++i) {
    three.push_back({{i % 3 == 1 ? 1.0 : 0.0, i % 3 == 2 ? 1.0 : 0.0, static_cast<double>(i % 3)}, 1.0});
  }
  const auto fit = fit_polynomial_surface(three, {.degree = 2});
  ASSERT_TRUE(fit.ok());
  EXPECT_EQ(fit->surface.degree(), 1);
  EXPECT_LE(fit->statistics.max, 1e-14);
}

TEST(PolynomialFit, X5_BadInputIsRefusedWithItsField) {
  std::mt19937_64 random(14);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<WeightedPoint> cloud = test::random_cloud(random, 10);
  cloud[3].position.z() = nan;
  EXPECT_EQ(fit_polynomial_surface(cloud).error().field, "points[3].position");
  cloud[3] = {Vec3::Zero(), nan};
  EXPECT_EQ(fit_polynomial_surface(cloud).error().field, "points[3].weight");
  cloud[3].weight = -0.1;
  EXPECT_EQ(fit_polynomial_surface(cloud).error().field, "points[3].weight");
  EXPECT_EQ(fit_polynomial_surface({}).error().code, ErrorCode::rank_deficient);
  EXPECT_EQ(fit_polynomial_surface(cloud, {.degree = 0}).error().field, "degree");
  EXPECT_EQ(fit_polynomial_surface(cloud, {.degree = 7}).error().field, "degree");
}

TEST(PolynomialFit, X5_AbsurdSizesNeverGiveNaN) {
  std::mt19937_64 random(15);
  for (const double size : {1e-200, 1e-30, 1e30, 1e99}) {
    for (const double weight : {1e-300, 1.0, 1e300}) {
      std::vector<WeightedPoint> cloud = test::random_cloud(random, 30);
      for (WeightedPoint& p : cloud) {
        p.position *= size;
        p.weight *= weight;
      }
      const auto fit = fit_polynomial_surface(cloud);
      if (!fit.ok()) continue;
      EXPECT_TRUE(std::isfinite(fit->surface.value(0, 0))) << size << " " << weight;
    }
  }
}

TEST(PolynomialFit, ScaleOfWeightsChangesNothing) {
  std::mt19937_64 random(16);
  std::vector<WeightedPoint> cloud = test::random_cloud(random, 100);
  const auto before = fit_polynomial_surface(cloud);
  for (WeightedPoint& p : cloud) p.weight *= 0x1p-600;
  const auto after = fit_polynomial_surface(cloud);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_EQ(before->surface, after->surface);
}

TEST(PolynomialFit, WorldPointsAreMeasuredInTheFrame) {
  std::mt19937_64 random(17);
  const Frame frame = test::random_frame(random);
  std::vector<WeightedPoint> cloud = test::random_cloud(random, 100);
  const auto local = fit_polynomial_surface(cloud);
  for (WeightedPoint& p : cloud) p.position = frame.to_world(p.position);
  const auto world = fit_polynomial_surface(cloud, frame);
  ASSERT_TRUE(local.ok() && world.ok());
  EXPECT_LE(largest_relative_difference(world->surface.coefficients(), local->surface.coefficients()), 1e-10);
}

}  // namespace
}  // namespace handloft::geometry
