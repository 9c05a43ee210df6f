#include "daemon-tracking/vision/triangulation.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace handloft::tracking {
namespace {

Eigen::Isometry3d looking_at_origin(const Eigen::Vector3d& from) {
  const Eigen::Vector3d forward = -from.normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << right, forward.cross(right), forward;
  pose.translation() = from;
  return pose;
}

class Triangulation : public ::testing::Test {
 protected:
  PointView view(const Eigen::Vector3d& from, const Eigen::Vector3d& point) const {
    PointView out{&model_, looking_at_origin(from), {0, 0}, Eigen::Matrix2d::Identity() * 0.25};
    out.pixel = *model_.project(out.world_from_camera.inverse() * point);
    return out;
  }
  CameraModel model_ = [] {
    CameraIntrinsics intrinsics;
    intrinsics.distortion = {-0.1, 0.03, 0.0005, -0.0004, 0.0};
    return CameraModel::create(intrinsics).value();
  }();
  const Eigen::Vector3d point_{0.04, -0.03, 0.08};
};

TEST_F(Triangulation, ExactViewsGiveThePoint) {
  const std::vector<PointView> views{view({0.5, -0.6, 0.4}, point_), view({-0.5, -0.6, 0.4}, point_)};
  const auto found = triangulate(views);
  ASSERT_TRUE(found.ok()) << found.error().describe();
  EXPECT_LT((found->position_m - point_).norm(), 1e-9);
  EXPECT_LT(found->worst_sigmas, 1e-6);
  // Half a pixel at 0.88 m and f = 600 px is 0.7 mm across.
  EXPECT_NEAR(std::sqrt(found->covariance.trace()), 1.1e-3, 0.4e-3);
}

TEST_F(Triangulation, TheSurerViewWeighsMore) {
  std::vector<PointView> views{view({0.5, -0.6, 0.4}, point_), view({-0.5, -0.6, 0.4}, point_),
                               view({0.0, -0.7, 0.5}, point_)};
  views[2].pixel += Eigen::Vector2d(2, 0);
  TriangulationOptions loose;
  loose.max_sigmas = 100;
  const double even = (triangulate(views, loose)->position_m - point_).norm();
  views[2].covariance *= 1e4;
  EXPECT_LT((triangulate(views, loose)->position_m - point_).norm(), 0.01 * even);
}

TEST_F(Triangulation, RefusesParallelRaysAndDisagreement) {
  std::vector<PointView> near{view({0.5, -0.6, 0.4}, point_), view({0.52, -0.6, 0.4}, point_)};
  EXPECT_EQ(triangulate(near).error().code, ErrorCode::failed_precondition);
  std::vector<PointView> apart{view({0.5, -0.6, 0.4}, point_), view({-0.5, -0.6, 0.4}, point_)};
  apart[0].pixel.y() += 40;
  EXPECT_EQ(triangulate(apart).error().code, ErrorCode::failed_precondition);
  EXPECT_FALSE(triangulate(std::span(apart).first(1)).ok());
  apart[0].pixel.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(triangulate(apart).error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace handloft::tracking
