#include "daemon-tracking/vision/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

namespace handloft::tracking {
namespace {

CameraIntrinsics webcam() {
  CameraIntrinsics out;
  out.fx_px = 602.0;
  out.fy_px = 597.0;
  out.cx_px = 322.4;
  out.cy_px = 237.1;
  out.distortion = {-0.105, 0.031, 0.0006, -0.0004, 0.002};
  return out;
}

const double nan = std::numeric_limits<double>::quiet_NaN();

TEST(CameraModel, ProjectsAsOpenCvDoes) {
  const CameraIntrinsics intrinsics = webcam();
  const CameraModel model = CameraModel::create(intrinsics).value();
  const cv::Matx33d matrix(intrinsics.fx_px, 0, intrinsics.cx_px, 0, intrinsics.fy_px, intrinsics.cy_px, 0, 0,
                           1);
  const cv::Vec<double, 5> distortion(intrinsics.distortion.data());
  for (double x : {-0.4, -0.1, 0.0, 0.33})
    for (double y : {-0.3, 0.0, 0.21})
      for (double z : {0.5, 0.8, 2.0}) {
        std::vector<cv::Point2d> expected;
        cv::projectPoints(std::vector<cv::Point3d>{{x, y, z}}, cv::Vec3d(), cv::Vec3d(), matrix, distortion,
                          expected);
        const auto pixel = model.project({x, y, z});
        ASSERT_TRUE(pixel);
        EXPECT_NEAR(pixel->x(), expected[0].x, 1e-9);
        EXPECT_NEAR(pixel->y(), expected[0].y, 1e-9);
      }
}

TEST(CameraModel, PrincipalRayIsHandValue) {
  const CameraModel model = CameraModel::create(webcam()).value();
  EXPECT_EQ(*model.project({0, 0, 1}), Eigen::Vector2d(322.4, 237.1));
  EXPECT_TRUE(model.ray({322.4, 237.1})->isApprox(Eigen::Vector3d::UnitZ(), 1e-12));
}

TEST(CameraModel, UnprojectInvertsOverTheWholeImage) {
  const CameraModel model = CameraModel::create(webcam()).value();
  for (double u = 0; u < 640; u += 53)
    for (double v = 0; v < 480; v += 37) {
      const auto point = model.unproject({u, v});
      ASSERT_TRUE(point) << u << " " << v;
      const auto back = model.project({point->x() * 0.7, point->y() * 0.7, 0.7});
      ASSERT_TRUE(back);
      EXPECT_LT((*back - Eigen::Vector2d(u, v)).norm(), 1e-6);
    }
}

TEST(CameraModel, JacobianIsTheDerivative) {
  const CameraModel model = CameraModel::create(webcam()).value();
  const Eigen::Vector3d point(0.21, -0.17, 0.83);
  const auto projection = model.project_with_jacobian(point);
  ASSERT_TRUE(projection);
  constexpr double step = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d ahead = point, behind = point;
    ahead(axis) += step;
    behind(axis) -= step;
    const Eigen::Vector2d slope = (*model.project(ahead) - *model.project(behind)) / (2 * step);
    EXPECT_LT((slope - projection->jacobian.col(axis)).norm(), 1e-4 * slope.norm() + 1e-4);
  }
}

TEST(CameraModel, RefusesWhatHasNoImage) {
  const CameraModel model = CameraModel::create(webcam()).value();
  EXPECT_FALSE(model.project({0, 0, -1}));
  EXPECT_FALSE(model.project({0, 0, 0}));
  EXPECT_FALSE(model.project({nan, 0, 1}));
  EXPECT_FALSE(model.unproject({nan, 3}));
  // Barrel distortion folds back far outside: such a point must not appear in the middle of the image.
  CameraIntrinsics strong = webcam();
  strong.distortion = {-0.4, 0, 0, 0, 0};
  const CameraModel folding = CameraModel::create(strong).value();
  EXPECT_TRUE(folding.project({0.5, 0, 1}));
  EXPECT_FALSE(folding.project({1.5, 0, 1}));
}

TEST(CameraModel, CreateNamesTheBadField) {
  CameraIntrinsics bad = webcam();
  bad.fx_px = 0;
  EXPECT_EQ(CameraModel::create(bad).error().field, "intrinsics.fx_px");
  bad = webcam();
  bad.distortion[2] = nan;
  EXPECT_EQ(CameraModel::create(bad).error().field, "intrinsics.distortion");
  bad = webcam();
  bad.width_px = 100000;
  EXPECT_EQ(CameraModel::create(bad).error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace handloft::tracking
