#include "server-model/geometry/pca_frame.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

double largest_difference(const Mat3& a, const Mat3& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

TEST(PcaFrame, A5_AxesOfABoxOfEightCorners) {
  std::vector<WeightedPoint> corners;
  for (const double x : {-3.0, 3.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double z : {-2.0, 2.0}) corners.push_back({{x + 10, y, z}, 1.0});
    }
  }
  const auto result = pca_frame(corners);
  ASSERT_TRUE(result.ok());
  Mat3 expected;  // x, then z, then y by variance; right-handed with the largest components of x and n
                  // positive
  expected.col(0) = Vec3(1, 0, 0);
  expected.col(1) = Vec3(0, 0, -1);
  expected.col(2) = Vec3(0, 1, 0);
  EXPECT_LE(largest_difference(result->frame.rotation, expected), 1e-15);
  EXPECT_LE((result->frame.origin - Vec3(10, 0, 0)).norm(), 1e-15);
  EXPECT_LE((result->variance - Vec3(9, 4, 1)).norm(), 1e-14);
  EXPECT_FALSE(result->degenerate);
}

TEST(PcaFrame, A5_MovesWithTheCloud) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 20; ++round) {
    std::vector<WeightedPoint> cloud = test::random_cloud(random, 200);
    const Frame motion = test::random_frame(random);
    PcaOptions options;
    options.towards_viewer = Vec3(0.1, -0.2, 1);
    const auto before = pca_frame(cloud, options);
    for (WeightedPoint& p : cloud) p.position = motion.to_world(p.position);
    // The x axis's sign by largest component does not turn with the cloud: continuity does.
    PcaOptions moved_options;
    moved_options.previous =
        Frame{motion.to_world(before->frame.origin), motion.rotation * before->frame.rotation};
    const auto after = pca_frame(cloud, moved_options);
    ASSERT_TRUE(before.ok() && after.ok());
    EXPECT_LE(largest_difference(after->frame.rotation, motion.rotation * before->frame.rotation), 1e-10);
    EXPECT_LE((after->frame.origin - motion.to_world(before->frame.origin)).norm(), 1e-10);
  }
}

TEST(PcaFrame, A5_OrderOfPointsDoesNotMatter) {
  std::mt19937_64 random(2);
  for (const std::size_t n : {8UL, 100UL, 1000UL, 20000UL}) {
    std::vector<WeightedPoint> cloud = test::random_cloud(random, n);
    const auto before = pca_frame(cloud);
    for (int round = 0; round < 5; ++round) {
      // Without its first point's privilege as reference: swap it, too.
      std::shuffle(cloud.begin(), cloud.end(), random);
      const auto after = pca_frame(cloud);
      EXPECT_LE(largest_difference(before->frame.rotation, after->frame.rotation), 1e-13) << n;
      EXPECT_LE((before->frame.origin - after->frame.origin).norm(), 1e-13) << n;
    }
  }
}

TEST(PcaFrame, A5_NormalTurnsTowardsTheViewer) {
  std::mt19937_64 random(3);
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 50);
  for (const double side : {1.0, -1.0}) {
    PcaOptions options;
    options.towards_viewer = Vec3(0, 0, side);
    const auto result = pca_frame(cloud, options);
    EXPECT_GT(side * result->frame.normal().z(), 0.9);
    EXPECT_NEAR(result->frame.rotation.determinant(), 1, 1e-12);
  }
}

TEST(PcaFrame, A5_RefitKeepsWithin90DegreesOfThePreviousFrame) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 50; ++round) {
    const std::vector<WeightedPoint> cloud = test::random_cloud(random, 30);
    PcaOptions options;
    options.previous = test::random_frame(random);
    const auto result = pca_frame(cloud, options);
    EXPECT_GE(result->frame.x_axis().dot(options.previous->x_axis()), 0);
    EXPECT_GE(result->frame.normal().dot(options.previous->normal()), 0);
    EXPECT_NEAR(result->frame.rotation.determinant(), 1, 1e-12);
  }
}

TEST(PcaFrame, A5_EqualVariancesProjectThePreviousXAxis) {
  std::vector<WeightedPoint> square;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) square.push_back({{x, y, 0}, 1.0});
  }
  PcaOptions options;
  options.previous = Frame{Vec3::Zero(), Eigen::AngleAxisd(0.3, Vec3::UnitZ()).toRotationMatrix()};
  const auto result = pca_frame(square, options);
  EXPECT_TRUE(result->degenerate);
  EXPECT_LE(largest_difference(result->frame.rotation, options.previous->rotation), 1e-12);
}

TEST(PcaFrame, A5_LineAndPointGiveAValidFrame) {
  std::vector<WeightedPoint> line;
  for (int i = 0; i < 10; ++i) line.push_back({{0.1 * i, 0.2 * i, 0.0}, 1.0});
  const std::vector<WeightedPoint> dot(5, WeightedPoint{{1, 2, 3}, 1.0});
  for (const auto& cloud : {line, dot}) {
    const auto result = pca_frame(cloud);
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result->degenerate);
    EXPECT_LE(
        largest_difference(result->frame.rotation.transpose() * result->frame.rotation, Mat3::Identity()),
        1e-12);
  }
  EXPECT_NEAR(pca_frame(line)->frame.normal().z(), 1, 1e-12);
}

TEST(PcaFrame, A5_WeightsPullTheFrameWhenAsked) {
  std::vector<WeightedPoint> cloud{{{0, 0, 0}, 1}, {{1, 0, 0}, 1}, {{0, 0.5, 0}, 1}, {{4, 4, 4}, 0}};
  PcaOptions options;
  options.weighting = PcaWeighting::by_pressure;
  EXPECT_NEAR(std::abs(pca_frame(cloud, options)->frame.normal().z()), 1, 1e-12);
  EXPECT_LT(std::abs(pca_frame(cloud)->frame.normal().z()), 0.9);
}

TEST(PcaFrame, BadInputIsRefusedWithItsField) {
  EXPECT_EQ(pca_frame({}).error().field, "points");
  std::vector<WeightedPoint> cloud(3);
  cloud[1].position.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(pca_frame(cloud).error().field, "points[1].position");
  cloud[1] = {Vec3::Zero(), -1};
  PcaOptions options;
  options.weighting = PcaWeighting::by_pressure;
  EXPECT_EQ(pca_frame(cloud, options).error().field, "points[1].weight");
  for (auto& p : cloud) p.weight = 0;
  EXPECT_EQ(pca_frame(cloud, options).error().code, ErrorCode::invalid_argument);
}

TEST(PcaFrame, TinyAndFarCloudsKeepTheirAxes) {
  std::vector<WeightedPoint> cloud;
  for (int i = 0; i < 9; ++i) {
    cloud.push_back({{1000 + 1e-6 * (i % 3) * 3, -1000 + 1e-6 * static_cast<double>(i / 3), 5}, 1.0});
  }
  const auto result = pca_frame(cloud);
  EXPECT_NEAR(std::abs(result->frame.x_axis().x()), 1, 1e-6);
  EXPECT_NEAR(std::abs(result->frame.normal().z()), 1, 1e-6);
}

}  // namespace
}  // namespace handloft::geometry
