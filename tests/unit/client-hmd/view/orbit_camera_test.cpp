#include "client-hmd/view/orbit_camera.h"

#include <gtest/gtest.h>

#include <glm/gtc/constants.hpp>
#include <limits>
#include <utility>
#include <vector>

namespace handloft::client {
namespace {

TEST(OrbitCamera, KeepsItsTargetInTheMiddle) {
  OrbitCamera camera;
  for (int i = 0; i < 50; ++i) {
    camera.orbit(0.37, 0.11);
    const Eye eye = camera.eye(640, 480);
    const glm::dvec3 seen = glm::dvec3(eye.eye_from_world() * glm::dvec4(camera.target, 1.0));
    EXPECT_NEAR(seen.x, 0.0, 1e-12);
    EXPECT_NEAR(seen.y, 0.0, 1e-12);
    EXPECT_NEAR(seen.z, -camera.distance_m, 1e-12);
    EXPECT_LT(std::abs(camera.elevation_rad), glm::half_pi<double>());
  }
}

TEST(OrbitCamera, LooksFromTheDesignersSideWithUpUpwards) {
  const Eye eye = OrbitCamera().eye(640, 480);
  EXPECT_LT(eye.world_from_eye.position.y, 0.0);
  EXPECT_GT((eye.world_from_eye.orientation * glm::dvec3(0, 1, 0)).z, 0.5);
}

TEST(OrbitCamera, ZoomStaysInBoundsWhateverComes) {
  OrbitCamera camera;
  for (const double factor : {1e9, 0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e-9})
    camera.zoom(factor);
  EXPECT_DOUBLE_EQ(camera.distance_m, 5.0);
  camera.zoom(1e9);
  EXPECT_DOUBLE_EQ(camera.distance_m, 0.05);
}

TEST(OrbitCamera, FitTouchesTheMarginsAndKeepsTheDirection) {
  const FitMargins margins;
  for (const auto& [width, height] : {std::pair{640, 480}, {1280, 720}, {300, 900}}) {
    OrbitCamera camera;
    camera.orbit(0.4, 0.2);
    const glm::dquat before = camera.eye(width, height).world_from_eye.orientation;
    // A box as large as a car, one the size of a mouse, and one place alone.
    for (const glm::dvec3& half :
         {glm::dvec3(0.9, 2.2, 0.7), glm::dvec3(0.03, 0.05, 0.02), glm::dvec3(0.0)}) {
      std::vector<glm::dvec3> places;
      for (int corner = 0; corner < 8; ++corner) {
        places.emplace_back(0.3 + ((corner & 1) != 0 ? half.x : -half.x),
                            -0.1 + ((corner & 2) != 0 ? half.y : -half.y),
                            0.2 + ((corner & 4) != 0 ? half.z : -half.z));
      }
      camera.fit(places, width, height);
      const Eye eye = camera.eye(width, height);
      EXPECT_NEAR(std::abs(glm::dot(before, eye.world_from_eye.orientation)), 1.0, 1e-12);
      double x = 0;
      double y = 0;
      for (const glm::dvec3& place : places) {
        const glm::dvec3 seen(eye.eye_from_world() * glm::dvec4(place, 1.0));
        ASSERT_LE(seen.z, -0.05 + 1e-9);
        x = std::max(x, std::abs(eye.pinhole.fx_px * seen.x / seen.z) / (0.5 * width));
        y = std::max(y, std::abs(eye.pinhole.fy_px * seen.y / seen.z) / (0.5 * height));
      }
      const double limit_x = 1 - 2 * margins.side;
      const double limit_y = 1 - 2 * margins.top_and_bottom;
      EXPECT_LE(x, limit_x + 1e-9);
      EXPECT_LE(y, limit_y + 1e-9);
      if (half.x > 0) {
        EXPECT_GT(std::max(x / limit_x, y / limit_y), 1 - 1e-9) << "no nearer than need be";
      }
    }
  }
}

TEST(OrbitCamera, FitToNothingChangesNothing) {
  OrbitCamera camera;
  const OrbitCamera before;
  camera.fit({}, 640, 480);
  const std::vector<glm::dvec3> spoilt{{0, 0, 0}, {std::numeric_limits<double>::quiet_NaN(), 0, 0}};
  camera.fit(spoilt, 640, 480);
  const std::vector<glm::dvec3> place{{0, 0, 0}};
  camera.fit(place, 0, 480);
  EXPECT_EQ(camera.target, before.target);
  EXPECT_EQ(camera.distance_m, before.distance_m);
}

TEST(OrbitCamera, PanMovesTheSceneWithTheHand) {
  OrbitCamera camera;
  const glm::dvec3 before = camera.target;
  const Eye eye = camera.eye(640, 480);
  camera.pan(0.5, 0.0);
  const glm::dvec3 moved =
      glm::inverse(glm::mat3_cast(eye.world_from_eye.orientation)) * (camera.target - before);
  EXPECT_LT(moved.x, 0.0) << "the camera goes left, so the scene goes right";
  EXPECT_NEAR(moved.y, 0.0, 1e-12);
}

}  // namespace
}  // namespace handloft::client
