// Invariants of the camera model and triangulation.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <limits>

#include "daemon-tracking/vision/camera_model.h"
#include "daemon-tracking/vision/triangulation.h"

namespace handloft::tracking {
namespace {

double number(int from, int to) {
  return *rc::gen::inRange(from, to) * 1e-3;
}

CameraModel any_camera() {
  CameraIntrinsics intrinsics;
  intrinsics.fx_px = 400 + number(0, 600'000);
  intrinsics.fy_px = intrinsics.fx_px * (1.0 + 0.02 * number(-1000, 1000));
  intrinsics.distortion = {0.3 * number(-1000, 1000), 0.1 * number(-1000, 1000), 0.002 * number(-1000, 1000),
                           0.002 * number(-1000, 1000), 0.02 * number(-1000, 1000)};
  return CameraModel::create(intrinsics).value();
}

TEST(VisionProperty, UnprojectingAProjectionGivesTheDirection) {
  EXPECT_TRUE(rc::check([] {
    const CameraModel camera = any_camera();
    const Eigen::Vector3d point(number(-300, 300), number(-300, 300), number(600, 3000));
    const auto pixel = camera.project(point);
    RC_PRE(pixel && camera.contains(*pixel));
    const auto direction = camera.unproject(*pixel);
    RC_ASSERT(direction.has_value());
    const auto again = camera.project({direction->x(), direction->y(), 1.0});
    RC_ASSERT(again.has_value());
    RC_ASSERT((*again - *pixel).norm() < 1e-5);
  }));
}

TEST(VisionProperty, AnyNumbersGiveAFiniteAnswerOrNone) {
  EXPECT_TRUE(rc::check([] {
    const CameraModel camera = any_camera();
    const auto wild =
        rc::gen::element(0.0, 1e-300, -1.0, 1.0, 1e9, -1e300, std::numeric_limits<double>::infinity(),
                         std::numeric_limits<double>::quiet_NaN());
    const Eigen::Vector3d point(*wild, *wild, *wild);
    if (const auto projection = camera.project_with_jacobian(point)) {
      RC_ASSERT(projection->pixel.allFinite());
      RC_ASSERT(projection->jacobian.allFinite());
    }
    if (const auto ray = camera.ray({*wild, *wild})) RC_ASSERT(ray->allFinite());
  }));
}

TEST(VisionProperty, TriangulationFindsEveryPointThatTwoCamerasSee) {
  EXPECT_TRUE(rc::check([] {
    const CameraModel camera = any_camera();
    const Eigen::Vector3d point(number(-100, 100), number(-100, 100), number(500, 1500));
    PointView left{&camera, Eigen::Isometry3d::Identity(), {0, 0}, Eigen::Matrix2d::Identity()};
    PointView right = left;
    right.world_from_camera.translation().x() = 0.4;
    right.world_from_camera.linear() = Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const auto left_pixel = camera.project(point);
    const auto right_pixel = camera.project(right.world_from_camera.inverse() * point);
    RC_PRE(left_pixel && right_pixel && camera.contains(*left_pixel) && camera.contains(*right_pixel));
    left.pixel = *left_pixel;
    right.pixel = *right_pixel;
    const PointView views[] = {left, right};
    const auto found = triangulate(views);
    RC_ASSERT(found.ok());
    RC_ASSERT((found->position_m - point).norm() < 1e-6);
  }));
}

}  // namespace
}  // namespace handloft::tracking
