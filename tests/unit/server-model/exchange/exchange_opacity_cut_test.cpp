// Meshes cut at half opacity (A26).

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "server-model/exchange/opacity_cut.h"

namespace handloft::exchange {
namespace {

using geometry::TriangleMesh;
using geometry::Vec3;

// A square of two triangles in z = 0, counterclockwise, whose opacity falls from 1 at x = 0 to 0 at x = 1.
TriangleMesh fading_square() {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.normals.assign(4, Vec3::UnitZ());
  mesh.opacity = {1, 0, 0, 1};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  return mesh;
}

double signed_area(const TriangleMesh& mesh) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const Vec3& a = mesh.positions[mesh.indices[3 * t]];
    const Vec3& b = mesh.positions[mesh.indices[3 * t + 1]];
    const Vec3& c = mesh.positions[mesh.indices[3 * t + 2]];
    area += 0.5 * (b - a).cross(c - a).z();
  }
  return area;
}

TEST(OpacityCut, A26_EndsAtTheContour) {
  const TriangleMesh half = cut_at_opacity(fading_square(), 0.5);
  EXPECT_NEAR(signed_area(half), 0.5, 1e-15);
  // (0, 0), (0, 1) and one crossing each on the lower edge, the diagonal and the upper edge.
  EXPECT_EQ(half.vertex_count(), 5U) << "the diagonal's crossing is shared";
  for (std::size_t i = 0; i < half.vertex_count(); ++i) {
    EXPECT_LE(half.positions[i].x(), 0.5 + 1e-15);
    EXPECT_GE(half.opacity[i], 0.5);
    EXPECT_NEAR((half.normals[i] - Vec3::UnitZ()).norm(), 0, 1e-15);
  }
  EXPECT_NEAR(signed_area(cut_at_opacity(fading_square(), 0.9)), 0.1, 1e-15);
}

TEST(OpacityCut, KeepsAllOrNothing) {
  TriangleMesh opaque = fading_square();
  opaque.opacity.assign(4, 1.0);
  const TriangleMesh same = cut_at_opacity(opaque, 0.5);
  EXPECT_EQ(same.vertex_count(), 4U);
  EXPECT_EQ(same.indices, opaque.indices);
  TriangleMesh faint = fading_square();
  faint.opacity.assign(4, 0.49);
  EXPECT_EQ(cut_at_opacity(faint, 0.5).vertex_count(), 0U);
  EXPECT_EQ(cut_at_opacity({}, 0.5).vertex_count(), 0U);
  TriangleMesh bad = fading_square();
  bad.opacity[0] = std::nan("");
  for (const Vec3& p : cut_at_opacity(bad, 0.5).positions) EXPECT_TRUE(p.allFinite());
}

}  // namespace
}  // namespace handloft::exchange
