#include "client-hmd/view/pinhole.h"

#include <gtest/gtest.h>

#include <glm/gtc/constants.hpp>
#include <limits>

namespace handloft::client {
namespace {

/// The pixel that OpenGL draws a point of the eye frame on, with the top left pixel's centre at (0, 0).
glm::dvec2 rasterised(const Pinhole& pinhole, const glm::dvec3& in_eye) {
  const glm::dvec4 clip = projection_matrix(pinhole, {}) * glm::dvec4(in_eye, 1.0);
  const glm::dvec2 ndc = glm::dvec2(clip) / clip.w;
  return {(ndc.x + 1.0) / 2.0 * pinhole.width_px - 0.5, (1.0 - ndc.y) / 2.0 * pinhole.height_px - 0.5};
}

Pinhole webcam() {
  Pinhole camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = 590.0;
  camera.fy_px = 592.0;
  camera.cx_px = 325.6;
  camera.cy_px = 236.7;
  return camera;
}

TEST(Pinhole, DrawsAPointOnThePixelWhereTheCameraSeesIt_V1) {
  const Pinhole camera = webcam();
  for (const glm::dvec3 in_camera :
       {glm::dvec3(0, 0, 0.5), glm::dvec3(0.1, -0.2, 0.6), glm::dvec3(-0.3, 0.2, 1.1)}) {
    const glm::dvec2 seen = project(camera, in_camera);
    const glm::dvec2 drawn = rasterised(camera, {in_camera.x, -in_camera.y, -in_camera.z});
    EXPECT_NEAR(drawn.x, seen.x, 1e-9);
    EXPECT_NEAR(drawn.y, seen.y, 1e-9);
  }
}

TEST(Pinhole, CoveringScalesAboutTheMiddleAndLeavesNoBorder) {
  const Pinhole camera = webcam();
  const Pinhole wide = covering_pinhole(camera, 1280, 720);
  EXPECT_DOUBLE_EQ(wide.fx_px, 2.0 * camera.fx_px);  // 4:3 into 16:9: the width decides.
  const glm::dvec3 point(0.05, -0.04, 0.7);
  const glm::dvec2 in_camera = project(camera, point);
  const glm::dvec2 in_wide = project(wide, point);
  EXPECT_NEAR(in_wide.x - 639.5, 2.0 * (in_camera.x - 319.5), 1e-9);
  EXPECT_NEAR(in_wide.y - 359.5, 2.0 * (in_camera.y - 239.5), 1e-9);
}

TEST(Pinhole, DistortsByHandValues) {
  // r^2 = 0.05; radial = 1 + 0.1 r^2; tangential with p1 = 0.01: (2 p1 x y, p1 (r^2 + 2 y^2)).
  const glm::dvec2 bent = distort({0.1, 0.0, 0.01, 0.0, 0.0}, {0.1, 0.2});
  EXPECT_NEAR(bent.x, 0.1 * 1.005 + 0.0004, 1e-15);
  EXPECT_NEAR(bent.y, 0.2 * 1.005 + 0.01 * (0.05 + 0.08), 1e-15);
  EXPECT_EQ(distort({}, {0.3, -0.2}), glm::dvec2(0.3, -0.2));
}

TEST(Pinhole, CameraAxesBecomeEyeAxes) {
  const RigidPose eye = eye_from_camera_axes({{1, 2, 3}, glm::dquat(1, 0, 0, 0)});
  const glm::dvec3 forwards = eye.orientation * glm::dvec3(0, 0, -1);
  const glm::dvec3 up = eye.orientation * glm::dvec3(0, 1, 0);
  EXPECT_NEAR(glm::distance(forwards, glm::dvec3(0, 0, 1)), 0.0, 1e-15);
  EXPECT_NEAR(glm::distance(up, glm::dvec3(0, -1, 0)), 0.0, 1e-15);
}

TEST(Pinhole, WarpTurnsFarPointsToWhereTheTurnedEyeSeesThem_V1) {
  const Pinhole pinhole = covering_pinhole(webcam(), 960, 540);
  const glm::dquat drawn = glm::angleAxis(0.3, glm::normalize(glm::dvec3(0.2, 1.0, 0.1)));
  const glm::dquat shown = glm::angleAxis(0.33, glm::normalize(glm::dvec3(0.25, 1.0, 0.1)));
  const glm::dvec3 far_away = drawn * glm::dvec3(40.0, -30.0, -400.0);
  const auto pixel = [&pinhole](const glm::dquat& eye, const glm::dvec3& world) {
    return rasterised(pinhole, glm::conjugate(eye) * world);
  };
  const glm::dvec2 display = pixel(shown, far_away);
  const glm::dvec3 source = rotation_warp(pinhole, drawn, shown) * glm::dvec3(display, 1.0);
  const glm::dvec2 expected = pixel(drawn, far_away);
  EXPECT_NEAR(source.x / source.z, expected.x, 1e-6);
  EXPECT_NEAR(source.y / source.z, expected.y, 1e-6);
  EXPECT_GT(glm::distance(display, expected), 5.0) << "the warp must be worth something";
  const glm::dmat3 none = rotation_warp(pinhole, drawn, drawn);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(glm::distance(none[i] / none[2][2], glm::dmat3(1.0)[i]), 0.0, 1e-9);
}

TEST(Pinhole, RefusesWhatNoCameraHas) {
  EXPECT_TRUE(check_pinhole(webcam()).ok());
  const auto refused = [](auto spoil) {
    Pinhole camera = webcam();
    spoil(camera);
    return !check_pinhole(camera).ok();
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused([](Pinhole& c) { c.width_px = 0; }));
  EXPECT_TRUE(refused([](Pinhole& c) { c.height_px = 1 << 20; }));
  EXPECT_TRUE(refused([](Pinhole& c) { c.fx_px = 0.0; }));
  EXPECT_TRUE(refused([](Pinhole& c) { c.fy_px = nan; }));
  EXPECT_TRUE(refused([](Pinhole& c) { c.cx_px = nan; }));
  EXPECT_TRUE(refused([](Pinhole& c) { c.distortion[3] = nan; }));
}

}  // namespace
}  // namespace handloft::client
