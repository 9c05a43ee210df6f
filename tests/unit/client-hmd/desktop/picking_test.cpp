// What is under the pointer (V6), against looking at every triangle, and rays through pixels.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "client-hmd/desktop/camera_control.h"
#include "client-hmd/desktop/picker.h"

namespace handloft::client {
namespace {

constexpr int width_px = 800, height_px = 600;

Eye eye_of(const OrbitCamera& camera) {
  return camera.eye(width_px, height_px);
}

/// A hilly grid of `side` x `side` squares over 0.2 m x 0.2 m, transparent beyond x = 0.08.
std::shared_ptr<const SurfaceMesh> hills(int side) {
  auto mesh = std::make_shared<SurfaceMesh>();
  for (int i = 0; i <= side; ++i) {
    for (int k = 0; k <= side; ++k) {
      const float x = -0.1F + 0.2F * static_cast<float>(i) / static_cast<float>(side);
      const float y = -0.1F + 0.2F * static_cast<float>(k) / static_cast<float>(side);
      SurfaceVertex vertex;
      vertex.position = {x, y, 0.05F + 0.01F * std::sin(40.0F * x) * std::cos(35.0F * y)};
      vertex.normal = {0.0F, 0.0F, 1.0F};
      vertex.opacity = x > 0.08F ? 0.0F : 1.0F;
      mesh->vertices.push_back(vertex);
    }
  }
  const auto at = [side](int i, int k) { return static_cast<std::uint32_t>(i * (side + 1) + k); };
  for (int i = 0; i < side; ++i) {
    for (int k = 0; k < side; ++k) {
      for (const std::uint32_t index :
           {at(i, k), at(i + 1, k), at(i, k + 1), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)}) {
        mesh->indices.push_back(index);
      }
    }
  }
  return mesh;
}

TEST(Picking, FindsWhatLookingAtEveryTriangleFinds) {
  const auto mesh = hills(60);
  const MeshIndex index(mesh);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(0.0, width_px), y(0.0, height_px);
  OrbitCamera camera;
  camera.target = {0.0, 0.0, 0.05};
  camera.distance_m = 0.4;
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Ray ray = ray_through(eye_of(camera), {x(random), y(random)});
    // One triangle a mesh: nothing can be passed over.
    double best = std::numeric_limits<double>::max();
    for (std::size_t t = 0; t < mesh->indices.size(); t += 3) {
      auto one = std::make_shared<SurfaceMesh>();
      for (std::size_t c = 0; c < 3; ++c) {
        one->vertices.push_back(mesh->vertices[mesh->indices[t + c]]);
        one->indices.push_back(static_cast<std::uint32_t>(c));
      }
      if (i % 30 != 0) break;  // A tenth of the rays against every triangle.
      if (const auto hit = MeshIndex(one).meet(ray)) best = std::min(best, hit->distance_m);
    }
    const auto hit = index.meet(ray);
    hits += hit ? 1 : 0;
    if (i % 30 != 0) continue;
    if (best == std::numeric_limits<double>::max()) {
      EXPECT_FALSE(hit) << i;
    } else {
      ASSERT_TRUE(hit) << i;
      EXPECT_DOUBLE_EQ(hit->distance_m, best);
    }
  }
  EXPECT_GT(hits, 100);
}

TEST(Picking, WhatIsLessThanHalfOpaqueIsNotThere_A26) {
  const MeshIndex index(hills(100));
  const auto down_at = [&](double x) { return index.meet({{x, 0.011, 1.0}, {0.0, 0.0, -1.0}}); };
  ASSERT_TRUE(down_at(0.075));
  EXPECT_NEAR(down_at(0.0)->distance_m, 0.95, 0.011);
  EXPECT_FALSE(down_at(0.09));
  EXPECT_FALSE(down_at(0.11));
}

TEST(Picking, AnEmptyMeshIsNothing) {
  const MeshIndex index(std::make_shared<const SurfaceMesh>());
  EXPECT_FALSE(index.meet({{0.0, 0.0, 1.0}, {0.0, 0.0, -1.0}}));
}

TEST(Pointer, ARayGoesThroughThePixelWhereAPlaceIsSeen) {
  const Eye eye = eye_of(OrbitCamera());
  const glm::dvec3 place(0.03, -0.02, 0.05);
  const auto pixel = seen_at(eye, place);
  ASSERT_TRUE(pixel);
  const Ray ray = ray_through(eye, *pixel);
  EXPECT_LT(glm::length(glm::cross(place - ray.origin, ray.direction)), 1e-12);
  EXPECT_FALSE(
      seen_at(eye, eye.world_from_eye.position + eye.world_from_eye.orientation * glm::dvec3(0, 0, 1)));
}

TEST(Pointer, MeetsNoPlaneThatItsRayHardlyMeets) {
  const Ray along{{0.0, 0.0, 0.1}, glm::normalize(glm::dvec3(1.0, 0.0, -0.01))};
  EXPECT_FALSE(meet(along, {{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}}));
  EXPECT_FALSE(meet({{0.0, 0.0, 0.1}, {0.0, 0.0, 1.0}}, {{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}})) << "behind";
}

TEST(Pointer, DragsAlongALineToTheMillimetreThatThePointerShows) {
  const Eye eye = eye_of(OrbitCamera());
  const glm::dvec3 from(0.02, 0.01, 0.05);
  for (const glm::dvec3 direction : {glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0), glm::dvec3(0.6, 0.0, 0.8)}) {
    for (const double way : {-0.03, 0.001, 0.05}) {
      const auto start = *seen_at(eye, from);
      const auto end = *seen_at(eye, from + way * direction);
      EXPECT_NEAR(along_line(eye, from, direction, start, end), way, 1e-9) << way;
    }
  }
}

TEST(Pointer, DragsUpAlongALineTowardsTheEye) {
  const Eye eye = eye_of(OrbitCamera());
  const glm::dvec3 from(0.0, 0.0, 0.05);
  const glm::dvec3 towards = glm::normalize(eye.world_from_eye.position - from);
  const auto start = *seen_at(eye, from);
  EXPECT_GT(along_line(eye, from, towards, start, start - glm::dvec2(0.0, 30.0)), 0.01);
  EXPECT_LT(along_line(eye, from, towards, start, start + glm::dvec2(0.0, 30.0)), -0.01);
}

TEST(Camera, StaysAtItsPivotAlsoWhereZoomMeetsItsLimits) {
  OrbitCamera camera;
  const glm::dvec3 held(0.05, 0.02, 0.04);
  const PictureSize size{width_px, height_px};
  for (int i = 0; i < 40; ++i) {
    const auto before = *seen_at(eye_of(camera), held);
    zoom_to(camera, held, i < 20 ? 3.0 : -6.0, size);
    const auto after = seen_at(eye_of(camera), held);
    ASSERT_TRUE(after);
    EXPECT_LT(glm::distance(before, *after), 1e-3) << i;
  }
}

}  // namespace
}  // namespace handloft::client
