#include "server-model/geometry/tessellate.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "server-model/geometry/trimesh.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

PolynomialSurface dome() {
  return *PolynomialSurface::from_coefficients(2, std::array{0.02, 0., 0., 0.5, -2., -4.});
}
Superellipse ellipse(double n) {
  return *Superellipse::create({{0.01, 0.0}, {0.06, 0.04}}, n);
}

TEST(Tessellate, A23_VerticesLieOnTheSurfaceWithTheirOpacity) {
  std::mt19937_64 random(60);
  const Frame frame = test::random_frame(random);
  for (const double n : {0.2, 0.5, 1.0, 2.0, 20.0}) {
    const Superellipse s = ellipse(n);
    const auto mesh = tessellate(dome(), frame, s);
    ASSERT_TRUE(mesh.ok());
    // |y'|^n at the tips of a star (n < 1) turns rounding of y' into as much as its n-th power.
    const double tolerance = n < 1 ? 2e-3 : 1e-9;
    double lowest = 1;
    for (std::size_t i = 0; i < mesh->vertex_count(); ++i) {
      const Vec3 local = frame.to_local(mesh->positions[i]);
      EXPECT_NEAR(local.z(), dome().value(local.x(), local.y()), 1e-12 * (1 + std::abs(local.z())));
      EXPECT_NEAR(mesh->normals[i].norm(), 1, 1e-12);
      EXPECT_NEAR(mesh->opacity[i], s.opacity(local.head<2>()), tolerance);
      EXPECT_LE(s.level(local.head<2>()), visible_level() + tolerance);
      lowest = std::min(lowest, mesh->opacity[i]);
    }
    EXPECT_LE(lowest, 1.0 / 255 + 1e-12) << "the last visible alpha is at the border";
  }
}

TEST(Tessellate, A23_BorderIsTheLastVisibleContour) {
  const auto mesh = tessellate(dome(), Frame{}, ellipse(2));
  const auto half_edges = to_trimesh(*mesh);
  ASSERT_TRUE(half_edges.ok());
  for (const auto v : half_edges->vertices()) {
    if (half_edges->is_boundary(v)) {
      EXPECT_NEAR(mesh->opacity[static_cast<std::size_t>(v.idx())], 1.0 / 255, 1e-12);
    }
  }
}

TEST(Tessellate, IsOneDiskSeenFromAbove) {
  for (const double n : {0.2, 1.0, 2.0, 20.0}) {
    const auto mesh = tessellate(dome(), Frame{}, ellipse(n));
    const auto half_edges = to_trimesh(*mesh);
    ASSERT_TRUE(half_edges.ok()) << half_edges.error().describe();
    const MeshTopology t = topology(*half_edges);
    EXPECT_EQ(t.euler_characteristic(), 1);
    EXPECT_EQ(t.components, 1U);
    EXPECT_EQ(t.boundary_loops, 1U);
    EXPECT_EQ(t.isolated_vertices, 0U);
    for (std::size_t i = 0; i < mesh->indices.size(); i += 3) {
      const Vec3& a = mesh->positions[mesh->indices[i]];
      const Vec3& b = mesh->positions[mesh->indices[i + 1]];
      const Vec3& c = mesh->positions[mesh->indices[i + 2]];
      EXPECT_GT((b - a).cross(c - a).z(), 0) << "n = " << n;
    }
  }
}

TEST(Tessellate, StaysWithinTheChordTolerance) {
  for (const double tolerance : {1e-3, 1e-4, 2e-5}) {
    TessellationOptions options;
    options.chord_tolerance_m = tolerance;
    options.max_divisions = 256;
    const auto mesh = tessellate(dome(), Frame{}, ellipse(2), options);
    ASSERT_TRUE(mesh.ok());
    double worst = 0;
    for (std::size_t i = 0; i < mesh->indices.size(); i += 3) {
      const Vec3 middle = (mesh->positions[mesh->indices[i]] + mesh->positions[mesh->indices[i + 1]] +
                           mesh->positions[mesh->indices[i + 2]]) /
                          3;
      worst = std::max(worst, std::abs(middle.z() - dome().value(middle.x(), middle.y())));
    }
    EXPECT_LE(worst, tolerance);
  }
}

TEST(Tessellate, A26_BoxModeCoversTheBoxOpaquely) {
  const Box2 box{{0.01, 0}, {0.06, 0.04}};
  const auto mesh = tessellate_box(dome(), Frame{}, box);
  ASSERT_TRUE(mesh.ok());
  double area = 0;
  for (std::size_t i = 0; i < mesh->indices.size(); i += 3) {
    const Vec3& a = mesh->positions[mesh->indices[i]];
    area +=
        (mesh->positions[mesh->indices[i + 1]] - a).cross(mesh->positions[mesh->indices[i + 2]] - a).z() / 2;
  }
  EXPECT_NEAR(area, 4 * 0.06 * 0.04, 1e-15);
  EXPECT_EQ(*std::min_element(mesh->opacity.begin(), mesh->opacity.end()), 1.0);
}

TEST(Tessellate, BadInputIsRefusedAndSizeIsBounded) {
  TessellationOptions options;
  options.chord_tolerance_m = 0;
  EXPECT_EQ(tessellate(dome(), Frame{}, ellipse(2), options).error().field, "chord_tolerance_m");
  options = {};
  options.max_divisions = 1 << 30;
  EXPECT_EQ(tessellate(dome(), Frame{}, ellipse(2), options).error().field, "divisions");
  EXPECT_EQ(tessellate_box(dome(), Frame{}, {{0, 0}, {0, 0}}).error().field, "box");

  const auto wild = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 1e12, 1e12});
  const auto mesh = tessellate(*wild, Frame{}, ellipse(0.2));
  ASSERT_TRUE(mesh.ok());
  EXPECT_LE(mesh->vertex_count(), 4U * 48 * 62);
  const auto overflow = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 1e308, 1e308});
  const auto big = Superellipse::create({{0, 0}, {1e10, 1e10}}, 2);
  EXPECT_EQ(tessellate(*overflow, Frame{}, *big).error().field, "surface");
}

}  // namespace
}  // namespace handloft::geometry
