#include "client-hmd/view/orbit_camera.h"

#include <gtest/gtest.h>

#include <glm/gtc/constants.hpp>
#include <limits>

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
