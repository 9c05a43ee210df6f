#include "server-model/geometry/trimesh.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.normals.assign(4, Vec3::UnitZ());
  mesh.opacity.assign(4, 1.0);
  mesh.indices = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  return mesh;
}

TEST(TriMesh, TopologyOfATetrahedron) {
  const auto mesh = to_trimesh(tetrahedron());
  ASSERT_TRUE(mesh.ok());
  const MeshTopology t = topology(*mesh);
  EXPECT_EQ(t.vertices, 4U);
  EXPECT_EQ(t.edges, 6U);
  EXPECT_EQ(t.faces, 4U);
  EXPECT_EQ(t.components, 1U);
  EXPECT_EQ(t.boundary_loops, 0U);
  EXPECT_EQ(t.euler_characteristic(), 2);
}

TEST(TriMesh, ThereAndBackKeepsTheMesh) {
  const TriangleMesh back = from_trimesh(*to_trimesh(tetrahedron()));
  EXPECT_EQ(back.positions, tetrahedron().positions);
  EXPECT_EQ(back.triangle_count(), 4U);
  // The corner's normal points away from the body.
  EXPECT_LT(back.normals[0].maxCoeff(), 0);
}

TEST(TriMesh, DefectsAreNamed) {
  TriangleMesh mesh = tetrahedron();
  mesh.indices[3] = 9;
  EXPECT_EQ(to_trimesh(mesh).error().field, "triangles[1]");
  mesh = tetrahedron();
  mesh.indices[4] = mesh.indices[3];
  EXPECT_EQ(to_trimesh(mesh).error().field, "triangles[1]");
  mesh = tetrahedron();
  std::swap(mesh.indices[10], mesh.indices[11]);  // One triangle inside out.
  EXPECT_EQ(to_trimesh(mesh).error().field, "triangles[3]");
  mesh.indices.pop_back();
  EXPECT_EQ(to_trimesh(mesh).error().field, "indices");
}

TEST(TriMesh, DecimationKeepsShapeAndBorder) {
  const auto dome = PolynomialSurface::from_coefficients(2, std::array{0.02, 0., 0., 0., -2., -4.});
  const auto s = Superellipse::create({{0, 0}, {0.06, 0.04}}, 2);
  TessellationOptions options;
  options.min_divisions = 32;
  const auto fine = tessellate(*dome, Frame{}, *s, options);
  const auto whole = to_trimesh(*fine);
  std::size_t border_before = 0;
  for (const auto v : whole->vertices()) border_before += whole->is_boundary(v) ? 1 : 0;
  const auto coarse = decimate(*whole, fine->triangle_count() / 4);
  ASSERT_TRUE(coarse.ok());
  const MeshTopology t = topology(*coarse);
  EXPECT_LE(t.faces, fine->triangle_count() / 4);
  EXPECT_EQ(t.euler_characteristic(), 1);
  EXPECT_EQ(t.boundary_loops, 1U);
  std::size_t border = 0;
  for (const auto v : coarse->vertices()) {
    const auto& p = coarse->point(v);
    EXPECT_NEAR(p[2], dome->value(p[0], p[1]), 1e-3);
    border += coarse->is_boundary(v) ? 1 : 0;
  }
  EXPECT_EQ(border, border_before);
  EXPECT_GE(border_before, 4U * 32) << "the options' divisions, at least";
  EXPECT_EQ(decimate(*to_trimesh(*fine), 0).error().field, "target_faces");
}

}  // namespace
}  // namespace handloft::geometry
