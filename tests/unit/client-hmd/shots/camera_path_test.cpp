// Camera paths: through their keys, smooth between them, seamless where they are loops.

#include "client-hmd/shots/camera_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/constants.hpp>

namespace handloft::client {
namespace {

OrbitCamera camera(double azimuth, double distance = 0.5) {
  OrbitCamera out;
  out.azimuth_rad = azimuth;
  out.distance_m = distance;
  return out;
}

CameraPath path(Easing easing, CameraPath::Ends ends = CameraPath::Ends::open) {
  return {{{0.0, camera(0.0)}, {1.0, camera(1.0, 0.8)}, {3.0, camera(2.0, 0.3)}, {4.0, camera(2.5)}},
          easing,
          ends};
}

/// Change of azimuth a second, from either side.
double speed(const CameraPath& of, double from_s, double to_s) {
  return (of.at(to_s).azimuth_rad - of.at(from_s).azimuth_rad) / (to_s - from_s);
}

TEST(CameraPath, GoesThroughItsKeys_V8) {
  for (const Easing easing : {Easing::smooth, Easing::linear}) {
    const CameraPath p = path(easing);
    EXPECT_NEAR(p.at(1.0).azimuth_rad, 1.0, 1e-12);
    EXPECT_NEAR(p.at(1.0).distance_m, 0.8, 1e-12);
    EXPECT_NEAR(p.at(3.0).distance_m, 0.3, 1e-12);
    EXPECT_NEAR(p.at(-5.0).azimuth_rad, 0.0, 1e-12);
    EXPECT_NEAR(p.at(99.0).azimuth_rad, 2.5, 1e-12);
    EXPECT_EQ(p.duration_s(), 4.0);
  }
}

TEST(CameraPath, IsSmoothAtItsKeysAndRestsAtItsEnds) {
  const double h = 1e-6;
  const CameraPath smooth = path(Easing::smooth);
  for (const double key : {1.0, 3.0}) {
    EXPECT_NEAR(speed(smooth, key - h, key), speed(smooth, key, key + h), 1e-4);
    EXPECT_GT(speed(smooth, key, key + h), 0.1);
  }
  // The slope at a key is that of the chord between its neighbours (Catmull and Rom).
  EXPECT_NEAR(speed(smooth, 1.0 - h, 1.0 + h), 2.0 / 3.0, 1e-4);
  EXPECT_NEAR(speed(smooth, 0.0, h), 0.0, 1e-4);
  EXPECT_NEAR(speed(smooth, 4.0 - h, 4.0), 0.0, 1e-4);
  const CameraPath linear = path(Easing::linear);
  EXPECT_GT(std::abs(speed(linear, 1.0 - h, 1.0) - speed(linear, 1.0, 1.0 + h)), 0.4) << "negative control";
}

TEST(CameraPath, ALoopHasNoSeam) {
  const CameraPath loop({{0.0, camera(0.0)}, {1.0, camera(2.0)}, {3.0, camera(glm::two_pi<double>())}},
                        Easing::smooth, CameraPath::Ends::loop);
  const double h = 1e-6;
  EXPECT_NEAR(speed(loop, 0.0, h), speed(loop, 3.0 - h, 3.0), 1e-4);
  EXPECT_GT(speed(loop, 0.0, h), 1.0) << "it does not stop there";
}

TEST(CameraPath, StaysPossibleWhereASplineSwingsBeyond) {
  OrbitCamera high = camera(0.0, 5.0), low = camera(0.0, 0.02);
  high.elevation_rad = 1.55;
  low.elevation_rad = 1.55;
  OrbitCamera flat = low;
  flat.elevation_rad = -1.5;
  const CameraPath wild({{0.0, flat}, {1.0, high}, {1.1, low}, {5.0, flat}}, Easing::smooth,
                        CameraPath::Ends::open);
  for (double t = 0.0; t <= 5.0; t += 0.01) {
    const OrbitCamera at = wild.at(t);
    EXPECT_GT(at.distance_m, 0.0);
    EXPECT_LT(std::abs(at.elevation_rad), glm::half_pi<double>());
    EXPECT_TRUE(std::isfinite(at.azimuth_rad + at.fov_y_rad));
  }
}

TEST(LookingFrom, PutsTheEyeWhereItIsSaid) {
  const glm::dvec3 eye(0.3, -0.5, 0.4), target(0.1, 0.0, 0.05);
  const OrbitCamera camera = looking_from(eye, target, 0.5, 40.0);
  const glm::dvec3 found = camera.eye(640, 480).world_from_eye.position;
  EXPECT_LT(glm::distance(found, eye), 1e-12);
  EXPECT_LE(std::abs(camera.azimuth_rad - 40.0), glm::pi<double>()) << "the short way from the key before";
  // Straight above there is no azimuth: the one before is kept.
  EXPECT_EQ(looking_from({0, 0, 1}, {0, 0, 0}, 0.5, 1.25).azimuth_rad, 1.25);
}

}  // namespace
}  // namespace handloft::client
