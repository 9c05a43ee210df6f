// A13: the modification disk of a closed hand.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "server-model/geometry/disk.h"

namespace handloft::geometry {
namespace {

constexpr double hand_radius_m = 0.04;

std::vector<Vec3> pentagon(const Vec3& centre, const Vec3& u, const Vec3& v) {
  std::vector<Vec3> tips;
  for (int i = 0; i < 5; ++i) {
    const double angle = 2 * std::numbers::pi * i / 5;
    tips.push_back(centre + hand_radius_m * (std::cos(angle) * u + std::sin(angle) * v));
  }
  return tips;
}

const Vec3 u = Vec3(1, 2, 2) / 3, v = Vec3(2, 1, -2) / 3, n = u.cross(v);

double angle_deg(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

TEST(Disk, A13_RegularPentagonGivesItsPlaneNormalAndCentroid) {
  const Vec3 centre(0.1, -0.2, 0.3);
  ModificationDisk disk;
  const auto pose = disk.update(pentagon(centre, u, v), 0.5);
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->normal - n).norm(), 1e-12);
  EXPECT_LT((pose->centre - centre).norm(), 1e-15);
  EXPECT_NEAR(newell_area(pentagon(centre, u, v)).norm(),
              2.5 * hand_radius_m * hand_radius_m * std::sin(2 * std::numbers::pi / 5), 1e-15);
}

TEST(Disk, A13_ReversedOrderFlipsTheSign) {
  auto tips = pentagon({0, 0, 0}, u, v);
  std::reverse(tips.begin(), tips.end());
  EXPECT_LT((newell_area(tips).normalized() + n).norm(), 1e-12);
  ModificationDisk fresh;
  EXPECT_LT((fresh.update(tips, 0)->normal + n).norm(), 1e-12);
}

TEST(Disk, A13_OrientationIsKeptWithTheLastFrameAndTheHint) {
  auto tips = pentagon({0, 0, 0}, u, v);
  ModificationDisk disk;
  ASSERT_TRUE(disk.update(tips, 0));
  std::reverse(tips.begin(), tips.end());
  EXPECT_LT((disk.update(tips, 0)->normal - n).norm(), 1e-12);
  ModificationDisk hinted({}, Vec3(-5 * n));
  EXPECT_LT((hinted.update(pentagon({0, 0, 0}, u, v), 0)->normal + n).norm(), 1e-12);
}

TEST(Disk, A13_FewerThanThreeFingersOrCollinearOnesKeepTheLastNormal) {
  const auto tips = pentagon({0, 0, 0}, u, v);
  ModificationDisk disk;
  EXPECT_FALSE(disk.update(std::span(tips).first(2), 0.5));  // No normal known yet.
  ASSERT_TRUE(disk.update(tips, 0.5));
  const auto two = disk.update(std::span(tips).first(2), 0.5);
  ASSERT_TRUE(two);
  EXPECT_EQ(angle_deg(two->normal, n) < 1e-6, true);
  EXPECT_LT((two->centre - 0.5 * (tips[0] + tips[1])).norm(), 1e-15);
  const std::array<Vec3, 3> line = {Vec3(0, 0, 0), Vec3(0.02, 0, 0), Vec3(0.04, 1e-5, 0)};
  EXPECT_LT((disk.update(line, 0.5)->normal - n).norm(), 1e-12);
}

TEST(Disk, A13_RadiusFollowsThePressure) {
  const auto tips = pentagon({0, 0, 0}, u, v);
  ModificationDisk disk;
  EXPECT_DOUBLE_EQ(disk.update(tips, 0)->radius_m, 0.005);
  EXPECT_DOUBLE_EQ(disk.update(tips, 1)->radius_m, 0.060);
  EXPECT_DOUBLE_EQ(disk.update(tips, 0.5)->radius_m, 0.0325);
  EXPECT_DOUBLE_EQ(disk.update(tips, 7)->radius_m, 0.060);
  EXPECT_DOUBLE_EQ(disk.update(tips, std::nan(""))->radius_m, 0.005);
}

TEST(Disk, A13_NoiseOfOneMillimetreTurnsTheNormalLessThanThreeDegrees) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 0.001 / std::sqrt(3.0));  // 1 mm RMS in space.
  for (int trial = 0; trial < 500; ++trial) {
    auto tips = pentagon({0, 0, 0}, u, v);
    for (Vec3& tip : tips) tip += Vec3(noise(random), noise(random), noise(random));
    ModificationDisk disk;
    ASSERT_LT(angle_deg(disk.update(tips, 0)->normal, n), 3);
  }
}

TEST(Disk, BadInputGivesNoDisk) {
  ModificationDisk disk({}, Vec3(0, 0, -1));
  EXPECT_FALSE(disk.update({}, 0.5));
  const std::array<Vec3, 1> bad = {Vec3(0, std::nan(""), 0)};
  EXPECT_FALSE(disk.update(bad, 0.5));
  ModificationDisk no_hint({}, Vec3(0, 0, 0));
  EXPECT_FALSE(no_hint.update(std::array<Vec3, 1>{Vec3(0, 0, 0)}, 0.5));
}

}  // namespace
}  // namespace handloft::geometry
