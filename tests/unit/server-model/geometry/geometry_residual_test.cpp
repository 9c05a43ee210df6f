// A8, the key requirement: points that follow a surface by residual matching refit to it exactly; and the
// wrong variants that the paper's text also allows do not.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "server-model/geometry/pca_frame.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/residual_matching.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

constexpr double exact_tolerance = 1e-9;

/// max |c - c1| / max |c1| in scaled coefficients; the boxes agree since footprints don't move.
double coefficient_error(const PolynomialSurface& refit, const PolynomialSurface& wanted) {
  double difference = 0;
  double scale = 0;
  for (std::size_t k = 0; k < wanted.scaled_coefficients().size(); ++k) {
    difference =
        std::max(difference, std::abs(refit.scaled_coefficients()[k] - wanted.scaled_coefficients()[k]));
    scale = std::max(scale, std::abs(wanted.scaled_coefficients()[k]));
  }
  return difference / scale;
}

struct Scene {
  std::vector<WeightedPoint> cloud;
  PolynomialSurface f0;
  PolynomialSurface f1;
};

/// Fewer points than coefficients carry a lower degree (A7): f1 is then of the space that they carry.
Scene make_scene(std::mt19937_64& random, std::size_t n, int degree) {
  Scene scene;
  scene.cloud = test::random_cloud(random, n);
  scene.f0 = fit_polynomial_surface(scene.cloud, {.degree = degree})->surface;
  scene.f1 = test::random_surface(random, scene.f0.degree(), scene.f0.box(), 0.03);
  return scene;
}

TEST(ResidualMatching, A8_RefitGivesTheNewSurface) {
  std::mt19937_64 random(30);
  for (int degree = 1; degree <= 4; ++degree) {
    for (const std::size_t n : {7UL, 16UL, 40UL, 1000UL, 10000UL, 100000UL}) {
      Scene s = make_scene(random, n, degree);
      if (n >= 40) {
        ASSERT_EQ(s.f0.degree(), degree);
      }
      const std::vector<double> residuals = vertical_residuals(s.f0, s.cloud);
      match_residuals(s.f1, residuals, s.cloud);
      const auto refit = fit_polynomial_surface(s.cloud, {.degree = degree});
      ASSERT_TRUE(refit.ok());
      ASSERT_EQ(refit->surface.degree(), s.f1.degree());
      EXPECT_LE(coefficient_error(refit->surface, s.f1), exact_tolerance)
          << "N = " << degree << ", n = " << n;
    }
  }
}

TEST(ResidualMatching, A8_InTheWorldFrame) {
  std::mt19937_64 random(31);
  Scene s = make_scene(random, 500, 2);
  const Frame frame = test::random_frame(random);
  for (WeightedPoint& p : s.cloud) p.position = frame.to_world(p.position);
  const std::vector<WeightedPoint> moved = follow_surface(s.cloud, frame, s.f0, s.f1);
  EXPECT_LE(coefficient_error(fit_polynomial_surface(moved, frame)->surface, s.f1), exact_tolerance);
}

TEST(ResidualMatching, A8_NegativeControl_OrthogonalResidualsFail) {
  std::mt19937_64 random(32);
  for (int degree = 1; degree <= 4; ++degree) {
    for (const std::size_t n : {40UL, 500UL, 10000UL}) {
      Scene s = make_scene(random, n, degree);
      for (WeightedPoint& p : s.cloud) {
        const double x = p.position.x();
        const double y = p.position.y();
        const double orthogonal = (p.position.z() - s.f0.value(x, y)) * s.f0.normal(x, y).z();
        p.position = s.f1.point(x, y) + orthogonal * s.f1.normal(x, y);
      }
      const auto refit = fit_polynomial_surface(s.cloud, {.degree = degree});
      EXPECT_GT(coefficient_error(refit->surface, s.f1), 1e4 * exact_tolerance) << degree << ", " << n;
    }
  }
}

TEST(ResidualMatching, A8_NegativeControl_ChangedWeightsFail) {
  std::mt19937_64 random(33);
  for (int degree = 1; degree <= 4; ++degree) {
    for (const std::size_t n : {40UL, 500UL, 10000UL}) {
      Scene s = make_scene(random, n, degree);
      match_residuals(s.f1, vertical_residuals(s.f0, s.cloud), s.cloud);
      for (WeightedPoint& p : s.cloud) p.weight = test::uniform(random, 0.05, 1);
      const auto refit = fit_polynomial_surface(s.cloud, {.degree = degree});
      EXPECT_GT(coefficient_error(refit->surface, s.f1), 1e4 * exact_tolerance) << degree << ", " << n;
    }
  }
}

TEST(ResidualMatching, A8_NegativeControl_RecomputedPlaneFails) {
  std::mt19937_64 random(34);
  Scene s = make_scene(random, 500, 2);
  match_residuals(s.f1, vertical_residuals(s.f0, s.cloud), s.cloud);
  PcaOptions options;
  options.previous = Frame{};
  const Frame plane = pca_frame(s.cloud, options)->frame;
  const auto refit = fit_polynomial_surface(s.cloud, plane);
  ASSERT_TRUE(refit.ok());
  double largest = 0;
  for (int i = -3; i <= 3; ++i) {
    const double x = 0.03 + 0.02 * i;
    const Vec3 in_plane = plane.to_local(s.f1.point(x, -0.02));
    largest = std::max(largest, std::abs(refit->surface.value(in_plane.x(), in_plane.y()) - in_plane.z()));
  }
  EXPECT_GT(largest, 1e-6);
}

TEST(ResidualMatching, A9_NegativeControl_PointsPushedSinceTheFitFail_RefitFirstIsExact) {
  std::mt19937_64 random(35);
  Scene s = make_scene(random, 500, 2);
  for (std::size_t i = 0; i < 50; ++i) s.cloud[i].position.z() += 0.02;
  std::vector<WeightedPoint> stale = s.cloud;
  match_residuals(s.f1, vertical_residuals(s.f0, stale), stale);
  EXPECT_GT(coefficient_error(fit_polynomial_surface(stale)->surface, s.f1), 1e-3);

  const PolynomialSurface current = fit_polynomial_surface(s.cloud)->surface;
  match_residuals(s.f1, vertical_residuals(current, s.cloud), s.cloud);
  EXPECT_LE(coefficient_error(fit_polynomial_surface(s.cloud)->surface, s.f1), exact_tolerance);
}

}  // namespace
}  // namespace handloft::geometry
