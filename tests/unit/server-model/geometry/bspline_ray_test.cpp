// The first hit of a ray on a B-spline surface: formulas, grazing rays, rays within the surface, misses.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "server-model/geometry/bspline_projection.h"
#include "tests/unit/server-model/geometry/bspline_shapes.h"

namespace handloft::geometry {
namespace {

using samples::Random;
using samples::uniform;

SurfaceProjector made(const BSplineSurface& surface) {
  return *SurfaceProjector::create(surface);
}

Vec3 random_place(Random& random, double extent) {
  return {uniform(random, -extent, extent), uniform(random, -extent, extent),
          uniform(random, -extent, extent)};
}

TEST(BSplineRay, SphereByFormula) {
  const BSplineSurface surface = samples::sphere(0.5);
  const SurfaceProjector projector = made(surface);
  Random random(1);
  int hits = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 origin = random_place(random, 1.5);
    const Vec3 direction = random_place(random, 1);
    const Vec3 d = direction.normalized();
    const double b = origin.dot(d), c = origin.squaredNorm() - 0.25, root = b * b - c;
    const auto hit = *projector.ray(origin, direction);
    if (std::abs(root) < 1e-9) continue;
    const double near = -b - std::sqrt(std::max(root, 0.0)), far = -b + std::sqrt(std::max(root, 0.0));
    const bool expected = root > 0 && far > 0;
    ASSERT_EQ(hit.has_value(), expected) << origin.transpose() << " along " << d.transpose();
    if (!expected) continue;
    ++hits;
    ASSERT_NEAR(hit->distance_m, near > 0 ? near : far, 1e-11 / std::sqrt(root));
    ASSERT_LT((surface.evaluate(hit->uv.x(), hit->uv.y()) - hit->place).norm(), 1e-13);
    ASSERT_LT((origin + hit->distance_m * d - hit->place).norm(), 1e-11);
  }
  EXPECT_GT(hits, 100);
}

TEST(BSplineRay, PolesAndSeam) {
  const SurfaceProjector projector = made(samples::sphere(0.5));
  for (const double x : {0.0, 1e-12, 1e-6}) {
    const auto hit = *projector.ray(Vec3(x, 0, 3), -Vec3::UnitZ());
    ASSERT_TRUE(hit.has_value()) << x;
    EXPECT_NEAR(hit->distance_m, 2.5, 1e-11);
  }
  const auto seam = *projector.ray(Vec3(3, 0, 0.1), -Vec3::UnitX());
  ASSERT_TRUE(seam.has_value());
  EXPECT_NEAR(seam->distance_m, 3 - std::sqrt(0.25 - 0.01), 1e-11);
}

TEST(BSplineRay, TangentTouchesAndBeyondMisses) {
  const SurfaceProjector projector = made(samples::sphere(0.5));
  for (int k = 0; k < 8; ++k) {
    const Vec3 side(std::cos(0.3 + k), std::sin(0.3 + k), 0);
    const Vec3 along(-side.y(), side.x(), 0);
    const auto touching = *projector.ray(0.5 * side - 2 * along, along);
    ASSERT_TRUE(touching.has_value()) << k;
    EXPECT_NEAR(touching->distance_m, 2, 1e-4);  // The distance is as flat as the touch.
    EXPECT_FALSE((*projector.ray((0.5 + 1e-9) * side - 2 * along, along)).has_value()) << k;
    EXPECT_TRUE((*projector.ray((0.5 - 1e-9) * side - 2 * along, along)).has_value()) << k;
  }
}

TEST(BSplineRay, FirstOfSeveralHits) {
  const SurfaceProjector projector = made(samples::torus(1, 0.3));
  EXPECT_NEAR((*projector.ray(Vec3(-5, 0, 0), Vec3(2, 0, 0)))->distance_m, 3.7, 1e-11);
  EXPECT_NEAR((*projector.ray(Vec3(-1, 0, 0), Vec3(2, 0, 0)))->distance_m, 0.3, 1e-11);
  EXPECT_NEAR((*projector.ray(Vec3(0, 0, 0), Vec3(2, 0, 0)))->distance_m, 0.7, 1e-11);
  EXPECT_FALSE((*projector.ray(Vec3(5, 0, 0), Vec3(2, 0, 0))).has_value());
  EXPECT_FALSE((*projector.ray(Vec3(0, 0, 5), -Vec3::UnitZ())).has_value());  // Through the hole.
}

TEST(BSplineRay, WithinThePlaneHitsItsEdge) {
  const SurfaceProjector projector = made(samples::flat(1, 1, 8, 8));
  const auto hit = *projector.ray(Vec3(-1, 0.37, 0), Vec3::UnitX());
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->distance_m, 1, 1e-9);
  const auto from_it = *projector.ray(Vec3(0.5, 0.37, 0), Vec3(1, 0, 1));
  ASSERT_TRUE(from_it.has_value());  // An origin on the surface is a hit.
  EXPECT_NEAR(from_it->distance_m, 0, 1e-12);
  EXPECT_FALSE((*projector.ray(Vec3(-1, 0.37, 1e-6), Vec3::UnitX())).has_value());
  EXPECT_FALSE((*projector.ray(Vec3(-1, 1.37, 0), Vec3::UnitX())).has_value());
}

// Rays that are aimed at a known place hit no later than there, and nothing lies before the hit.
TEST(BSplineRay, AimedRaysNeverMiss) {
  Random random(2);
  for (const samples::Kind u : samples::kinds) {
    for (const samples::Weights weights : {samples::Weights::none, samples::Weights::random}) {
      const int p = 1 + static_cast<int>(random() % 4), q = 1 + static_cast<int>(random() % 4);
      const BSplineSurface surface =
          samples::random_surface(random, u, samples::Kind::clamped, p, q, weights);
      const SurfaceProjector projector = made(surface);
      for (int k = 0; k < 60; ++k) {
        const Vec3 target = surface.evaluate(uniform(random, surface.u.lower(), surface.u.upper()),
                                             uniform(random, surface.v.lower(), surface.v.upper()));
        const Vec3 origin = random_place(random, 3);
        const auto hit = *projector.ray(origin, target - origin);
        ASSERT_TRUE(hit.has_value()) << p << ", " << q;
        ASSERT_LE(hit->distance_m, (target - origin).norm() + 1e-9);
        ASSERT_LT((surface.evaluate(hit->uv.x(), hit->uv.y()) - hit->place).norm(), 1e-12);
        const Vec3 d = (target - origin).normalized();
        ASSERT_LT((origin + hit->distance_m * d - hit->place).norm(), 1e-10);
      }
    }
  }
}

TEST(BSplineRay, BatchesAnswerAlike) {
  const SurfaceProjector projector = made(samples::wavy(12, 12));
  Random random(3);
  std::vector<Vec3> origins(600), directions(600);
  for (std::size_t k = 0; k < origins.size(); ++k) {
    origins[k] = Vec3(uniform(random, 0, 1), uniform(random, 0, 1), 1);
    directions[k] = Vec3(uniform(random, -1, 1), uniform(random, -1, 1), -1);
  }
  std::vector<std::optional<SurfaceHit>> hits(origins.size());
  ASSERT_TRUE(projector.rays(origins, directions, hits).ok());
  int found = 0;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    const auto alone = *projector.ray(origins[k], directions[k]);
    ASSERT_EQ(hits[k].has_value(), alone.has_value());
    if (!alone) continue;
    ++found;
    ASSERT_EQ(hits[k]->distance_m, alone->distance_m);
  }
  EXPECT_GT(found, 100);
  directions[4].setZero();
  EXPECT_EQ(projector.rays(origins, directions, hits).error().field, "directions[4]");
}

}  // namespace
}  // namespace handloft::geometry
