#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <charconv>
#include <cstring>
#include <limits>
#include <locale>
#include <sstream>
#include <string>

#include "server-model/exchange/gltf_writer.h"
#include "server-model/exchange/obj_writer.h"
#include "server-model/geometry/trimesh.h"
#include "tests/support/test_data.h"

namespace handloft::exchange {
namespace {

using geometry::Vec3;

MeshExport dome(const std::string& name = "dome") {
  const auto surface =
      geometry::PolynomialSurface::from_coefficients(2, std::array{0.02, 0., 0., 0.5, -2., -4.});
  geometry::Frame frame;
  frame.origin = {100, -50, 7};
  MeshExport item;
  item.name = name;
  item.mesh =
      *geometry::tessellate(*surface, frame, *geometry::Superellipse::create({{0, 0}, {0.06, 0.04}}, 2));
  return item;
}

PointCloudExport cloud() {
  return {"points", {{{0, 0, 1}, 0.5}, {{1, 0, 2}, 1.0}, {{0, 1, 3}, 0.0}}, 0.1F, 0.2F, 0.3F};
}

tinygltf::Model load(const std::vector<std::byte>& bytes) {
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error;
  std::string warning;
  EXPECT_TRUE(loader.LoadBinaryFromMemory(&model, &error, &warning,
                                          reinterpret_cast<const unsigned char*>(bytes.data()),
                                          static_cast<unsigned>(bytes.size())))
      << error;
  EXPECT_EQ(warning, "");
  return model;
}

std::vector<float> floats(const tinygltf::Model& model, int accessor_index) {
  const auto& accessor = model.accessors[static_cast<std::size_t>(accessor_index)];
  const auto& view = model.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
  std::vector<float> values(view.byteLength / sizeof(float));
  std::memcpy(values.data(), model.buffers[0].data.data() + view.byteOffset, view.byteLength);
  return values;
}

TEST(GltfWriter, AnotherReaderFindsTheSameMesh) {
  const std::vector<MeshExport> meshes{dome()};
  const auto bytes = to_glb(meshes, std::vector{cloud()});
  ASSERT_TRUE(bytes.ok());
  const tinygltf::Model model = load(*bytes);
  ASSERT_EQ(model.meshes.size(), 2U);
  EXPECT_EQ(model.meshes[0].name, "dome");
  EXPECT_EQ(model.nodes[1].name, "dome");
  const auto& primitive = model.meshes[0].primitives[0];
  EXPECT_EQ(primitive.mode, TINYGLTF_MODE_TRIANGLES);
  const std::vector<float> positions = floats(model, primitive.attributes.at("POSITION"));
  const std::vector<float> colors = floats(model, primitive.attributes.at("COLOR_0"));
  const std::vector<float> normals = floats(model, primitive.attributes.at("NORMAL"));
  const auto& t = model.nodes[1].translation;
  const geometry::TriangleMesh& mesh = meshes[0].mesh;
  ASSERT_EQ(positions.size(), 3 * mesh.vertex_count());
  for (std::size_t i = 0; i < mesh.vertex_count(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Vec3::Index>(k);
      EXPECT_NEAR(positions[3 * i + k] + t[k], mesh.positions[i][axis], 1e-8) << "100 m away, still exact";
      EXPECT_NEAR(normals[3 * i + k], mesh.normals[i][axis], 1e-6);
    }
    EXPECT_EQ(colors[4 * i + 3], static_cast<float>(mesh.opacity[i]));
  }
  EXPECT_EQ(model.materials[0].alphaMode, "BLEND");
  EXPECT_TRUE(model.materials[0].doubleSided);
  EXPECT_EQ(model.meshes[1].primitives[0].mode, TINYGLTF_MODE_POINTS);
}

TEST(GltfWriter, OurUpIsTheirUp) {
  const tinygltf::Model model = load(*to_glb(std::vector{dome()}));
  const auto& q = model.nodes[0].rotation;
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  EXPECT_LE((rotation * Vec3::UnitZ() - Vec3::UnitY()).norm(), 1e-12);
}

TEST(GltfWriter, SameInputSameBytesInWholeWords) {
  const auto a = to_glb(std::vector{dome("ä\xff")});
  ASSERT_TRUE(a.ok()) << "a name that is not UTF-8 is no reason to fail";
  EXPECT_EQ(*a, *to_glb(std::vector{dome("ä\xff")}));
  EXPECT_EQ(a->size() % 4, 0U);
}

TEST(MeshWriters, BadMeshesAreRefusedWithTheirField) {
  EXPECT_EQ(to_glb({}).error().field, "meshes");
  EXPECT_EQ(to_obj({}).error().field, "meshes");
  std::vector<MeshExport> meshes{dome(), dome()};
  meshes[1].mesh.normals.pop_back();
  EXPECT_EQ(to_glb(meshes).error().field, "meshes[1].normals");
  EXPECT_EQ(to_obj(meshes).error().field, "meshes[1].normals");
  meshes[1] = dome();
  meshes[1].mesh.indices[0] = 1'000'000;
  EXPECT_EQ(to_glb(meshes).error().field, "meshes[1].indices");
  meshes[1] = dome();
  meshes[1].mesh.positions[4].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(to_glb(meshes).error().field, "meshes[1].vertices[4]");
  PointCloudExport points = cloud();
  points.points[1].weight = 2;
  EXPECT_EQ(to_glb({}, std::vector{points}).error().field, "clouds[0].points[1]");
}

TEST(ObjWriter, OpenMeshReadsTheSameMeshBack) {
  const test::TemporaryDirectory folder;
  const std::filesystem::path path = folder.path() / "dome.obj";
  const MeshExport item = dome("a name");
  ASSERT_TRUE(write_obj(path, std::vector{item}).ok());
  geometry::TriMesh mesh;
  OpenMesh::IO::Options options(OpenMesh::IO::Options::VertexNormal);
  ASSERT_TRUE(OpenMesh::IO::read_mesh(mesh, path.string(), options));
  ASSERT_EQ(mesh.n_vertices(), item.mesh.vertex_count());
  ASSERT_EQ(mesh.n_faces(), item.mesh.triangle_count());
  constexpr double float_at_100_m = 1e-5;  // OpenMesh reads coordinates as floats.
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    const Vec3& expected = item.mesh.positions[static_cast<std::size_t>(v.idx())];
    EXPECT_LE((Vec3(p[0], p[1], p[2]) - expected).norm(), float_at_100_m);
  }
}

TEST(ObjWriter, NumbersReadBackToTheSameBits) {
  const MeshExport item = dome();
  std::istringstream lines(*to_obj(std::vector{item}));
  lines.imbue(std::locale::classic());
  std::string line;
  std::size_t vertex = 0;
  while (std::getline(lines, line)) {
    if (line.rfind("v ", 0) != 0) continue;
    const char* p = line.data() + 1;
    for (Vec3::Index k = 0; k < 3; ++k) {
      double value = 0;
      p = std::from_chars(p + 1, line.data() + line.size(), value).ptr;
      EXPECT_EQ(value, item.mesh.positions[vertex][k]);
    }
    ++vertex;
  }
  EXPECT_EQ(vertex, item.mesh.vertex_count());
}

TEST(ObjWriter, SecondObjectCountsOn) {
  const auto text = to_obj(std::vector{dome("one"), dome("t w o")});
  ASSERT_TRUE(text.ok());
  EXPECT_NE(text->find("o t_w_o\n"), std::string::npos);
  const std::string first = std::to_string(dome().mesh.vertex_count() + 1);
  EXPECT_NE(text->find("f " + first + "//" + first), std::string::npos);
}

}  // namespace
}  // namespace handloft::exchange
