// A14: the swept push of the disk.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "server-model/geometry/push.h"
#include "server-model/geometry/push_solver.h"

namespace handloft::geometry {
namespace {

const Vec3 down(0, 0, -1);

DiskPose disk_at(double x, double z, double radius = 0.02) {
  return {{x, 0, z}, down, radius};
}

// The motion from a to b cut into `pieces`: centre and radius linear, normal turning steadily.
std::vector<DiskPose> cut(const DiskPose& a, const DiskPose& b, int pieces) {
  const auto turn = Eigen::Quaterniond::FromTwoVectors(a.normal, b.normal);
  std::vector<DiskPose> poses;
  for (int i = 0; i <= pieces; ++i) {
    const double t = static_cast<double>(i) / pieces;
    poses.push_back({(1 - t) * a.centre + t * b.centre,
                     (Eigen::Quaterniond::Identity().slerp(t, turn) * a.normal).normalized(),
                     (1 - t) * a.radius_m + t * b.radius_m});
  }
  return poses;
}

Vec3 pushed(Vec3 p, const std::vector<DiskPose>& poses) {
  for (std::size_t i = 1; i < poses.size(); ++i) p = DiskSweep(poses[i - 1], poses[i]).push(p);
  return p;
}

TEST(Push, A14_PointInFrontIsCarriedToTheDiskAlongItsNormal) {
  const DiskSweep sweep(disk_at(0, 0.10), disk_at(0, 0.04));
  const Vec3 p = sweep.push({0.01, 0.005, 0.07});
  EXPECT_LT((p - Vec3(0.01, 0.005, 0.04)).norm(), 1e-15);
}

TEST(Push, A14_PointsBehindOrBesideOrNotReachedStay) {
  const DiskSweep sweep(disk_at(0, 0.10), disk_at(0, 0.04));
  for (const Vec3& p : {Vec3(0, 0, 0.11), Vec3(0, 0, 0.1001), Vec3(0.021, 0, 0.07), Vec3(0, 0, 0.03)}) {
    EXPECT_EQ(sweep.push(p), p);
  }
}

TEST(Push, A14_NothingIsPulledByARecedingDisk) {
  const DiskSweep sweep(disk_at(0, 0.04), disk_at(0, 0.10));
  for (const Vec3& p : {Vec3(0, 0, 0.07), Vec3(0, 0, 0.04), Vec3(0, 0, 0.03)}) EXPECT_EQ(sweep.push(p), p);
}

TEST(Push, A14_AHandOfFiveRadiiAFrameDoesNotTunnel) {
  const DiskSweep sweep(disk_at(0, 0.10), disk_at(0, 0.0));
  EXPECT_LT((sweep.push({0, 0, 0.05})).norm(), 1e-15);
  // Five radii sideways and downwards: the disk passes over where it is only at the crossing.
  const DiskSweep slanted({{-0.05, 0, 0.06}, down, 0.02}, {{0.05, 0, 0.04}, down, 0.02});
  EXPECT_GT(0.05 - slanted.push({0, 0, 0.05}).z(), 1e-4);
  // Negative control: ends alone would see nothing, as neither disk is near the point.
  EXPECT_GT((slanted.from().centre - Vec3(0, 0, 0.05)).norm(), 0.04);
  EXPECT_GT((slanted.to().centre - Vec3(0, 0, 0.05)).norm(), 0.04);
}

TEST(Push, A14_SlidingOffEndsThePushWhereTheRimPasses) {
  // Down 20 mm and 40 mm sideways in one frame; a point 10 mm behind the rim is met at t = 0 and left at t =
  // 0.5.
  const DiskSweep sweep(disk_at(0, 0.05), disk_at(0.04, 0.03));
  const Vec3 p = sweep.push({0, 0, 0.05});
  EXPECT_NEAR(p.z(), 0.05 - 0.5 * 0.02, 1e-12);
  EXPECT_EQ(p.x(), 0);
}

TEST(Push, A14_PushIsParallelToTheNormal) {
  const Vec3 n = Vec3(1, -2, -2) / 3;
  auto solver = PushSolver::create(std::vector<Vec3>{{0, 0, 0}, {0.003, 0.001, -0.002}, {0.5, 0, 0}});
  ASSERT_TRUE(solver);
  for (const double s : {-0.03, -0.01, 0.02}) {
    ASSERT_TRUE(solver->move_disk({s * n + Vec3(0.001 * s, 0, 0), 2.5 * n, 0.02}));
  }
  ASSERT_EQ(solver->contacts().size(), 2U);
  for (const Contact& c : solver->contacts()) {
    EXPECT_LT(c.displacement.cross(n).norm(), 1e-17);
    EXPECT_GT(c.displacement.dot(n), 0.01);
  }
}

TEST(Push, A17_AMotionCutIntoPiecesPushesAlike) {
  const DiskPose from{{-0.01, 0.02, 0.08}, Vec3(0.1, 0.2, -1).normalized(), 0.02};
  const DiskPose to{{0.015, 0.0, 0.03}, Vec3(-0.4, 0.5, -1).normalized(), 0.035};
  const DiskPose still{to.centre, from.normal, 0.02};
  int moved = 0, slid = 0;
  for (const DiskPose& end : {to, still}) {
    for (int i = -8; i <= 8; ++i) {
      for (int j = -8; j <= 8; ++j) {
        const Vec3 p(0.005 * i, 0.005 * j, 0.05 + 0.0004 * (i * j % 7));
        const Vec3 whole = pushed(p, cut(from, end, 1));
        for (const int pieces : {3, 10}) {
          ASSERT_LT((pushed(p, cut(from, end, pieces)) - whole).norm(), 1e-12) << i << " " << j;
        }
        moved += whole != p;
        slid += whole != p && std::abs((whole - end.centre).dot(end.normal)) > 1e-6;
      }
    }
  }
  EXPECT_GT(moved, 50);
  EXPECT_GT(slid, 5);
}

TEST(Push, A17_ADiskThatTurnsAndRecedesAndComesAgain) {
  // A rocking disk: points on one side are left and met again.
  const DiskPose a{{0, 0, 0.05}, Vec3(0.3, 0, -1).normalized(), 0.05};
  const DiskPose b{{0, 0, 0.045}, Vec3(-0.3, 0, -1).normalized(), 0.05};
  for (const double x : {-0.03, -0.02, -0.005, 0.0, 0.01, 0.03}) {
    const Vec3 p(x, 0.004, 0.041);
    auto coarse = cut(a, b, 1), fine = cut(a, b, 9);
    for (const auto& [one, pieces] : {std::pair{&coarse, 1}, std::pair{&fine, 9}}) {
      const auto back = cut(b, a, pieces);
      one->insert(one->end(), back.begin() + 1, back.end());
    }
    const Vec3 whole = pushed(p, coarse), pieces = pushed(p, fine);
    EXPECT_LT((whole - pieces).norm(), 1e-10) << x;
  }
}

TEST(Push, OppositeNormalsAreSurvived) {
  const DiskSweep sweep({{0, 0, 0.05}, Vec3(0, 0, 1), 0.02}, {{0, 0, 0.0}, Vec3(0, 0, -1), 0.02});
  EXPECT_TRUE(sweep.push({0.001, 0.002, 0.02}).allFinite());
}

TEST(Push, BadPosesAreRefusedAndChangeNothing) {
  auto solver = PushSolver::create(std::vector<Vec3>{{0, 0, 0}});
  ASSERT_TRUE(solver);
  ASSERT_TRUE(solver->move_disk(disk_at(0, 0.01)));
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(solver->move_disk({{nan, 0, 0}, down, 0.1}).error().field, "centre");
  EXPECT_EQ(solver->move_disk({{1e300, 0, 0}, down, 0.1}).error().field, "centre");
  EXPECT_EQ(solver->move_disk({{0, 0, 0}, {0, 0, 0}, 0.1}).error().field, "normal");
  EXPECT_EQ(solver->move_disk({{0, 0, 0}, {0, inf, 0}, 0.1}).error().field, "normal");
  EXPECT_EQ(solver->move_disk({{0, 0, 0}, down, -1}).error().field, "radius_m");
  EXPECT_TRUE(solver->contacts().empty());
  ASSERT_TRUE(solver->move_disk(disk_at(0, -0.01)));
  EXPECT_EQ(solver->contacts().size(), 1U);
  EXPECT_FALSE(PushSolver::create(std::vector<Vec3>{{0, nan, 0}}));
  auto empty = PushSolver::create({});
  ASSERT_TRUE(empty);
  ASSERT_TRUE(empty->move_disk(disk_at(0, 0.01)));
  ASSERT_TRUE(empty->move_disk(disk_at(0, 0.0)));
  EXPECT_TRUE(empty->displacements(1, Falloff::smooth).empty());
}

}  // namespace
}  // namespace handloft::geometry
