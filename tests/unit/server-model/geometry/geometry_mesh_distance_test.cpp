// A28: the distance of points to a reference mesh, against shapes whose distance is a formula.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "server-model/geometry/mesh_distance.h"
#include "tests/unit/server-model/geometry/test_meshes.h"

namespace handloft::geometry {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

MeshDistance made(const test::Triangles& mesh) {
  return *MeshDistance::create(mesh.positions, mesh.indices);
}

/// Of an axis-aligned box around the origin: outside to the nearest part, inside minus the nearest face.
double box_distance(const Vec3& p, const Vec3& half) {
  const Vec3 q = p.cwiseAbs() - half;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

std::vector<Vec3> random_points(std::size_t n, double extent, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-extent, extent);
  std::vector<Vec3> points(n);
  for (Vec3& p : points) p = {uniform(random), uniform(random), uniform(random)};
  return points;
}

TEST(MeshDistance, A28_BoxIsExactEverywhere) {
  const Vec3 half(0.1, 0.05, 0.02);
  const MeshDistance mesh = made(test::box(half));
  for (const Vec3& p : random_points(20000, 0.2, 1)) {
    const NearestOnMesh found = mesh.nearest(p);
    ASSERT_NEAR(found.signed_distance_m, box_distance(p, half), 1e-15) << p.transpose();
    ASSERT_NEAR(box_distance(found.point, half), 0.0, 1e-15);
    ASSERT_NEAR((p - found.point).norm(), std::abs(found.signed_distance_m), 1e-15);
  }
}

// Where the sign of a single face's normal fails: beyond edges and corners, along their diagonals.
TEST(MeshDistance, A28_SignIsRightAtEdgesAndCorners) {
  const Vec3 half(0.1, 0.05, 0.02);
  const MeshDistance mesh = made(test::box(half));
  for (const Vec3& direction :
       {Vec3(1, 1, 1), Vec3(-1, 1, -1), Vec3(1, 1, 0), Vec3(0, -1, 1), Vec3(1, 0, -1)}) {
    const Vec3 at = half.cwiseProduct(direction);
    for (const double step : {1e-12, 1e-6, 1e-2}) {
      EXPECT_NEAR(mesh.nearest(at + step * direction).signed_distance_m, step * direction.norm(), 1e-15);
      EXPECT_LT(mesh.nearest(at - step * direction).signed_distance_m, 0.0);
    }
    EXPECT_NEAR(mesh.nearest(at).signed_distance_m, 0.0, 1e-17);
  }
}

// A spike so sharp that the faces around its tip see points beyond it from both sides: a vertex needs the
// angle-weighted sum, not one face.
TEST(MeshDistance, A28_SignBeyondASharpTip) {
  test::Triangles spike;
  spike.positions = {{0, 0, 1}, {0.01, 0, 0}, {-0.005, 0.00866, 0}, {-0.005, -0.00866, 0}};
  spike.indices = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
  const MeshDistance mesh = made(spike);
  for (const Vec3& p : random_points(2000, 0.001, 2)) {
    EXPECT_GT(mesh.nearest(Vec3(0, 0, 1.01) + p).signed_distance_m, 0.0);
  }
  EXPECT_LT(mesh.nearest(Vec3(0, 0, 0.9)).signed_distance_m, 0.0);
}

TEST(MeshDistance, A28_SphereConvergesWithItsTriangles) {
  double before = 0;
  for (int times = 1; times <= 4; ++times) {
    const MeshDistance mesh = made(test::sphere(0.1, times, {0.3, -0.2, 0.5}));
    double worst = 0;
    for (const Vec3& p : random_points(1000, 0.2, 3)) {
      worst = std::max(worst,
                       std::abs(mesh.nearest(Vec3(0.3, -0.2, 0.5) + p).signed_distance_m - (p.norm() - 0.1)));
    }
    if (times > 1) {
      EXPECT_NEAR(before / worst, 4.0, 1.0) << times;  // Second order.
    }
    before = worst;
  }
}

TEST(MeshDistance, A28_TreeAgreesWithEveryTriangle) {
  const test::Triangles all = test::sphere(0.1, 3);
  const MeshDistance mesh = made(all);
  std::vector<MeshDistance> single;
  for (std::size_t i = 0; i < all.indices.size(); i += 3) {
    single.push_back(*MeshDistance::create(all.positions, std::span(all.indices).subspan(i, 3)));
  }
  const std::vector<Vec3> points = random_points(200, 0.15, 4);
  std::vector<double> batch(points.size());
  ASSERT_TRUE(mesh.signed_distances(points, batch).ok());
  for (std::size_t i = 0; i < points.size(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const MeshDistance& triangle : single) {
      nearest = std::min(nearest, std::abs(triangle.nearest(points[i]).signed_distance_m));
    }
    EXPECT_EQ(std::abs(batch[i]), nearest);
    EXPECT_EQ(batch[i], mesh.nearest(points[i]).signed_distance_m);
    EXPECT_EQ(batch[i] < 0, points[i].norm() < 0.0999 ? true : batch[i] < 0);
  }
}

TEST(MeshDistance, RigidMotionChangesNothing) {
  const test::Triangles there = test::box({0.1, 0.05, 0.02});
  test::Triangles here = there;
  const Mat3 q = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  for (Vec3& p : here.positions) p = q * p + Vec3(1, 2, 3);
  const MeshDistance a = made(there);
  const MeshDistance b = made(here);
  for (const Vec3& p : random_points(1000, 0.2, 5)) {
    EXPECT_NEAR(a.nearest(p).signed_distance_m, b.nearest(q * p + Vec3(1, 2, 3)).signed_distance_m, 1e-14);
  }
}

TEST(MeshDistance, AnOpenMeshTellsItsSides) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const MeshDistance mesh = *MeshDistance::create(square, std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
  EXPECT_EQ(mesh.nearest({0.3, 0.4, 0.2}).signed_distance_m, 0.2);
  EXPECT_EQ(mesh.nearest({0.3, 0.4, -0.2}).signed_distance_m, -0.2);
  EXPECT_NEAR(mesh.nearest({2.0, 0.5, -1.0}).signed_distance_m, -std::sqrt(2.0), 1e-15);
}

TEST(MeshDistance, TrianglesWithoutAreaDontCount) {
  test::Triangles mesh = test::box({1, 1, 1});
  mesh.indices.insert(mesh.indices.begin(), {0, 0, 1, 2, 2, 2});
  const MeshDistance distance = made(mesh);
  EXPECT_EQ(distance.triangle_count(), 12U);
  EXPECT_EQ(distance.nearest({0, 0, 3}).signed_distance_m, 2.0);
  EXPECT_GE(distance.nearest({0, 0, 3}).triangle, 2U);
  // A needle thinner than the rounding of its own area still gives a number.
  const std::vector<Vec3> needle{{1000, 0, 0}, {2000, 1e-11, 0}, {3000, 0, 0}};
  const auto thin = MeshDistance::create(needle, std::vector<std::uint32_t>{0, 1, 2});
  ASSERT_TRUE(thin.ok());
  for (const Vec3& p : random_points(1000, 3000, 6)) {
    EXPECT_TRUE(std::isfinite(thin->nearest(p).signed_distance_m));
  }
}

TEST(MeshDistance, BadInputIsRefusedWithItsField) {
  const test::Triangles box = test::box({1, 1, 1});
  const auto field = [](const std::vector<Vec3>& positions, const std::vector<std::uint32_t>& indices) {
    const auto mesh = MeshDistance::create(positions, indices);
    return mesh.ok() ? std::string("none") : mesh.error().field;
  };
  EXPECT_EQ(field({}, {}), "indices");
  EXPECT_EQ(field(box.positions, {0, 1}), "indices");
  EXPECT_EQ(field(box.positions, {0, 1, 8}), "indices[2]");
  EXPECT_EQ(field({{0, 0, 0}, {1, nan, 0}, {0, 1, 0}}, {0, 1, 2}), "positions[1]");
  EXPECT_EQ(field({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {0, 1, 2}), "indices");
  const MeshDistance mesh = made(box);
  std::vector<double> out(2);
  EXPECT_EQ(mesh.signed_distances(std::vector<Vec3>{{0, 0, 0}, {nan, 0, 0}}, out).error().field, "points[1]");
  EXPECT_EQ(mesh.signed_distances(std::vector<Vec3>{{0, 0, 0}}, out).error().field, "distances");
}

}  // namespace
}  // namespace handloft::geometry
