// A28: meshes around which shapes are designed, in every format that we read, good and bad.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>

#include "server-model/exchange/gltf_writer.h"
#include "server-model/exchange/iges_writer.h"
#include "server-model/exchange/reference_import.h"
#include "server-model/exchange/step_writer.h"
#include "server-model/geometry/mesh_distance.h"
#include "tests/support/test_data.h"

namespace handloft::exchange {
namespace {

using geometry::Vec3;

/// A box of 2 x 4 x 6 around the origin, its eight corners and six quadrilaterals.
constexpr std::array<std::array<int, 4>, 6> box_faces{
    {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};

Vec3 corner(int i) {
  return {(i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 2.0 : -2.0, (i & 4) != 0 ? 3.0 : -3.0};
}

std::string box_obj() {
  std::string text = "mtllib ../../secret.mtl\no box\n";
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = corner(i);
    text += "v " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
  }
  text += "usemtl red\n";
  for (const auto& face : box_faces) {
    text += "f";
    for (const int i : face) text += " " + std::to_string(i + 1);
    text += "\n";
  }
  return text;
}

void put_float(std::string& bytes, double value) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  for (unsigned k = 0; k < 4; ++k) bytes.push_back(static_cast<char>((bits >> (8U * k)) & 0xffU));
}

void put_integer(std::string& bytes, std::uint32_t value, unsigned size) {
  for (unsigned k = 0; k < size; ++k) bytes.push_back(static_cast<char>((value >> (8U * k)) & 0xffU));
}

std::string box_stl() {
  std::string bytes(80, ' ');
  put_integer(bytes, 12, 4);
  for (const auto& face : box_faces) {
    for (const std::array<int, 3>& t : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
      for (int k = 0; k < 3; ++k) put_float(bytes, 0.0);
      for (const int k : t) {
        for (int axis = 0; axis < 3; ++axis)
          put_float(bytes, corner(face[static_cast<std::size_t>(k)])[axis]);
      }
      put_integer(bytes, 0, 2);
    }
  }
  return bytes;
}

std::string box_ply(const std::string& vertex_count = "8") {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + vertex_count +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face 6\n"
                     "property list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = corner(i);
    text += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
  }
  for (const auto& face : box_faces) {
    text += "4";
    for (const int i : face) text += " " + std::to_string(i);
    text += "\n";
  }
  return text;
}

std::string box_buffer() {
  std::string bytes;
  for (int i = 0; i < 8; ++i) {
    for (int axis = 0; axis < 3; ++axis) put_float(bytes, corner(i)[axis]);
  }
  for (const auto& face : box_faces) {
    for (const std::size_t k : {0U, 1U, 2U, 0U, 2U, 3U}) {
      put_integer(bytes, static_cast<std::uint32_t>(face[k]), 2);
    }
  }
  return bytes;  // 96 bytes of positions, 72 of indices.
}

/// `nodes` replaces the scene's tree: one node with the box.
std::string box_gltf(const std::string& uri, const std::string& nodes = R"([{"mesh":0}])",
                     const std::string& extra = "") {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" + nodes +
         R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
     "accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"},
                  {"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}],
     "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":72}],
     "buffers":[{"byteLength":168,"uri":")" +
         uri + R"("}])" + extra + "}";
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

Result<ImportedReference> parse(const std::string& text, ReferenceFormat format,
                                ReferenceOptions options = {}) {
  return parse_reference(bytes_of(text), format, options);
}

/// Closed, outwards, and where it should be: by its distance to known places.
void expect_box(const ImportedReference& mesh, const Vec3& half, double tolerance = 1e-6) {
  EXPECT_EQ(mesh.positions.size(), 8U);
  EXPECT_EQ(mesh.indices.size(), 36U);
  EXPECT_NEAR((mesh.upper - half).norm(), 0, tolerance) << mesh.upper.transpose();
  EXPECT_NEAR((mesh.lower + half).norm(), 0, tolerance) << mesh.lower.transpose();
  const auto distance = geometry::MeshDistance::create(mesh.positions, mesh.indices);
  ASSERT_TRUE(distance.ok());
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Vec3 outside = side * (half[axis] + 0.5) * Vec3::Unit(axis);
      EXPECT_NEAR(distance->nearest(outside).signed_distance_m, 0.5, tolerance);
    }
  }
  EXPECT_NEAR(distance->nearest(Vec3::Zero()).signed_distance_m, -half.minCoeff(), tolerance);
}

class ReferenceFile : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& content) {
    std::ofstream(folder_.path() / name, std::ios::binary) << content;
    return folder_.path() / name;
  }
  test::TemporaryDirectory folder_;
};

TEST(Reference, A28_ObjStlAndPlyGiveTheSameBox) {
  const Vec3 half(1, 2, 3);
  for (const auto& [text, format] :
       {std::pair{box_obj(), ReferenceFormat::obj}, std::pair{box_stl(), ReferenceFormat::stl},
        std::pair{box_ply(), ReferenceFormat::ply}}) {
    const auto mesh = parse(text, format);
    ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
    expect_box(*mesh, half);
    EXPECT_EQ(mesh->dropped_triangles, 0U);
  }
  EXPECT_EQ(parse(box_stl(), ReferenceFormat::stl)->welded_vertices, 28U);  // 36 corners in the file.
}

TEST(Reference, A28_ScaleUpAxisAndTranslation) {
  ReferenceOptions options;
  options.scale = 0.001;
  options.up = UpAxis::y;
  auto mesh = parse(box_obj(), ReferenceFormat::obj, options);
  ASSERT_TRUE(mesh.ok());
  expect_box(*mesh, Vec3(0.001, 0.003, 0.002), 1e-9);  // y became z.
  options.translation = {1, 2, 3};
  mesh = parse(box_obj(), ReferenceFormat::obj, options);
  ASSERT_TRUE(mesh.ok());
  EXPECT_NEAR((mesh->lower + mesh->upper - 2 * options.translation).norm(), 0, 1e-6);
}

TEST_F(ReferenceFile, A28_GltfInItsThreeForms) {
  const Vec3 half(1, 3, 2);  // Metres, and its +Y is our +Z.
  write("box.bin", box_buffer());
  auto mesh = import_reference(write("box.gltf", box_gltf("box.bin")));
  ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
  expect_box(*mesh, half);

  const std::string json = box_gltf("box.bin");
  std::string text = json;
  text.erase(text.find(R"(,"uri":"box.bin")"), std::string(R"(,"uri":"box.bin")").size());
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string glb = "glTF";
  put_integer(glb, 2, 4);
  put_integer(glb, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + 168), 4);
  put_integer(glb, static_cast<std::uint32_t>(text.size()), 4);
  glb += "JSON" + text;
  put_integer(glb, 168, 4);
  glb += std::string("BIN\0", 4) + box_buffer();
  mesh = import_reference(write("box.GLB", glb));
  ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
  expect_box(*mesh, half);
  // Cut off anywhere, it is an error and nothing worse.
  for (std::size_t length = 0; length < glb.size(); length += 7) {
    EXPECT_FALSE(parse(glb.substr(0, length), ReferenceFormat::glb).ok()) << length;
  }
}

TEST(Reference, A28_GltfNodesPlaceAndMirror) {
  const std::string data = "data:application/octet-stream;base64,";
  std::string base64;
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::string raw = box_buffer();  // 168 bytes: a whole number of threes.
  for (std::size_t i = 0; i < raw.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = (bits << 8U) | static_cast<std::uint8_t>(raw[i + k]);
    for (int shift = 18; shift >= 0; shift -= 6)
      base64 += alphabet[(bits >> static_cast<unsigned>(shift)) & 63U];
  }
  auto mesh = parse(box_gltf(data + base64, R"([{"children":[1],"translation":[0,0,-5]},
                                                {"mesh":0,"scale":[-1,1,1],"translation":[10,0,0]}])"),
                    ReferenceFormat::gltf);
  ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
  EXPECT_NEAR((mesh->lower - Vec3(9, 2, -2)).norm(), 0, 1e-6) << mesh->lower.transpose();
  EXPECT_NEAR((mesh->upper - Vec3(11, 8, 2)).norm(), 0, 1e-6) << mesh->upper.transpose();
  // Mirrored by its node, the outside stays outside.
  const auto distance = geometry::MeshDistance::create(mesh->positions, mesh->indices);
  EXPECT_NEAR(distance->nearest({10, 5, 0}).signed_distance_m, -1.0, 1e-6);

  const auto refused = [&](const std::string& nodes, const std::string& extra = "") {
    const auto result = parse(box_gltf(data + base64, nodes, extra), ReferenceFormat::gltf);
    return result.ok() ? std::string("read") : std::string(to_string(result.error().code));
  };
  EXPECT_EQ(refused(R"([{"mesh":0}])"), "read");
  EXPECT_EQ(refused(R"([{"children":[0],"mesh":0}])"), "data_corrupt");
  EXPECT_EQ(refused(R"([{"children":[1]},{"children":[2]},{"children":[1],"mesh":0}])"), "data_corrupt");
  EXPECT_EQ(refused(R"([{"mesh":1}])"), "data_corrupt");
  EXPECT_EQ(refused(R"([{"mesh":0,"translation":[0,"x",0]}])"), "data_corrupt");
  EXPECT_EQ(refused(R"([{"mesh":0}])", R"(,"extensionsRequired":["KHR_draco_mesh_compression"])"),
            "unsupported");
}

TEST_F(ReferenceFile, GltfBuffersComeFromBesideItOnly) {
  const auto code = [&](const std::string& uri) {
    const auto mesh = import_reference(write("box.gltf", box_gltf(uri)));
    return mesh.ok() ? std::string("read") : std::string(to_string(mesh.error().code));
  };
  write("box.bin", box_buffer());
  std::filesystem::create_directory(folder_.path() / "inner");
  write("inner/box.bin", box_buffer());
  std::filesystem::create_symlink(folder_.path() / "inner/box.bin", folder_.path() / "link.bin");
  EXPECT_EQ(code("box.bin"), "read");
  EXPECT_EQ(code("inner/box.bin"), "permission_denied");
  EXPECT_EQ(code("../" + folder_.path().filename().string() + "/box.bin"), "permission_denied");
  EXPECT_EQ(code((folder_.path() / "box.bin").string()), "permission_denied");
  EXPECT_EQ(code("file:box.bin"), "permission_denied");
  EXPECT_EQ(code("%2e%2e"), "permission_denied");
  EXPECT_EQ(code("link.bin"), "permission_denied");
  EXPECT_EQ(code("none.bin"), "not_found");
  write("box.bin", box_buffer().substr(0, 100));
  EXPECT_EQ(code("box.bin"), "data_corrupt");
}

TEST_F(ReferenceFile, A28_StepAndIgesComeInMetresFromTheirOwnUnit) {
  SurfaceExport item;
  item.name = "plate";
  item.superellipse = *geometry::Superellipse::create({{0.01, 0.02}, {0.06, 0.04}}, 2.0);
  item.frame.origin = {0.1, -0.05, 0.2};
  item.trim = Trim::box;
  const geometry::Vec2 half = item.superellipse.contour_half_extent(geometry::trim_level());
  const Vec3 centre = item.frame.origin + Vec3(0.01, 0.02, 0);
  for (const bool iges : {false, true}) {
    const auto path = folder_.path() / (iges ? "plate.IGS" : "plate.step");
    ASSERT_TRUE((iges ? write_iges(path, {&item, 1}) : write_step(path, {&item, 1})).ok());
    const auto mesh = import_reference(path);
    ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
    EXPECT_NEAR((mesh->lower - (centre - Vec3(half.x(), half.y(), 0))).norm(), 0, 1e-6) << iges;
    EXPECT_NEAR((mesh->upper - (centre + Vec3(half.x(), half.y(), 0))).norm(), 0, 1e-6) << iges;
    // The side of the normals is the surface's.
    const auto distance = geometry::MeshDistance::create(mesh->positions, mesh->indices);
    EXPECT_NEAR(distance->nearest(centre + Vec3(0, 0, 0.01)).signed_distance_m, 0.01, 1e-6) << iges;
  }
  // The same in inches: the unit is read, not guessed.
  std::ifstream stream(folder_.path() / "plate.IGS");
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const std::size_t unit = text.find(",2,2HMM,");
  ASSERT_NE(unit, std::string::npos) << text.substr(0, 500);
  text.replace(unit, 8, ",1,2HIN,");
  const auto inches = import_reference(write("inch.igs", text));
  ASSERT_TRUE(inches.ok()) << inches.error().describe();
  EXPECT_NEAR(inches->upper.x() - inches->lower.x(), 25.4 * 2 * half.x(), 1e-4);
}

TEST_F(ReferenceFile, A28_CurvedCadFacesAreWithinTheChordAndClosed) {
  SurfaceExport item;
  item.surface = *geometry::PolynomialSurface::from_scaled(2, {{0, 0}, {0.06, 0.04}},
                                                           std::array{0., 0.01, 0., 0.02, 0.01, -0.02});
  item.superellipse = *geometry::Superellipse::create({{0, 0}, {0.06, 0.04}}, 2.0);
  const auto path = folder_.path() / "shell.stp";
  ASSERT_TRUE(write_step(path, {&item, 1}).ok());
  const auto mesh = import_reference(path);
  ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
  EXPECT_GT(mesh->indices.size(), 300U);
  for (std::size_t t = 0; t < mesh->indices.size(); t += 3) {
    const Vec3 middle = (mesh->positions[mesh->indices[t]] + mesh->positions[mesh->indices[t + 1]] +
                         mesh->positions[mesh->indices[t + 2]]) /
                        3.0;
    EXPECT_NEAR(middle.z(), item.surface.value(middle.x(), middle.y()), 1.5e-4);
  }
}

TEST(Reference, OurOwnGlbComesBackAsItWas) {
  MeshExport item;
  for (int i = 0; i < 3; ++i) item.mesh.positions.push_back(corner(1 << i));
  item.mesh.normals.assign(3, Vec3(0, 0, 1));
  item.mesh.opacity.assign(3, 1.0);
  item.mesh.indices = {0, 1, 2};
  const auto glb = to_glb({&item, 1});
  ASSERT_TRUE(glb.ok());
  const auto mesh = parse_reference(*glb, ReferenceFormat::glb);
  ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
  ASSERT_EQ(mesh->positions.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR((mesh->positions[i] - item.mesh.positions[i]).norm(), 0, 1e-6);
}

TEST(Reference, WeldsWithinTheToleranceAndDropsSlivers) {
  // Two triangles whose shared edge differs by a tenth of the tolerance, and one that is a line.
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0.0000001 0\nv 0 1.0000001 0\nv 1 1 0\nv 0.5 0 0\n"
      "f 1 2 3\nf 4 6 5\nf 1 7 2\n";
  const auto mesh = parse(obj, ReferenceFormat::obj);
  ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
  EXPECT_EQ(mesh->positions.size(), 4U);
  EXPECT_EQ(mesh->indices, (std::vector<std::uint32_t>{0, 1, 2, 1, 3, 2}));
  EXPECT_GE(mesh->welded_vertices, 2U);  // The reader may give each triangle its own.
  EXPECT_EQ(mesh->dropped_triangles, 1U);
}

// An L: a fan from its first corner would leave it.
TEST(Reference, ConcavePolygonsAreCutInside) {
  const std::string obj = "v 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nv 2 0 0\nf 1 2 3 4 5 6\n";
  const auto mesh = parse(obj, ReferenceFormat::obj);
  ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
  ASSERT_EQ(mesh->indices.size(), 12U);
  double area = 0;
  for (std::size_t t = 0; t < mesh->indices.size(); t += 3) {
    const Vec3 a = mesh->positions[mesh->indices[t]];
    const Vec3 b = mesh->positions[mesh->indices[t + 1]];
    const Vec3 c = mesh->positions[mesh->indices[t + 2]];
    const double z = 0.5 * (b - a).cross(c - a).z();
    EXPECT_GT(z, 0) << "all wind as the polygon does";
    area += z;
  }
  EXPECT_NEAR(area, 3.0, 1e-12);
}

TEST_F(ReferenceFile, BadFilesAreRefusedByNameWithWhatWasExpected) {
  const auto describe = [](const Result<ImportedReference>& result) {
    return result.ok() ? std::string("read") : result.error().describe();
  };
  EXPECT_EQ(import_reference(folder_.path() / "none.obj").error().code, ErrorCode::not_found);
  EXPECT_EQ(import_reference(folder_.path() / "none.obj").error().field, "path");
  EXPECT_EQ(import_reference(folder_.path() / "none.step").error().code, ErrorCode::not_found);
  EXPECT_EQ(import_reference(write("a.fbx", "x")).error().code, ErrorCode::unsupported);
  std::filesystem::create_directory(folder_.path() / "folder.stl");
  EXPECT_EQ(import_reference(folder_.path() / "folder.stl").error().code, ErrorCode::io);
  for (const char* name : {"a.obj", "a.stl", "a.ply", "a.gltf", "a.glb", "a.step", "a.iges"}) {
    for (const char* content :
         {"", "hello\n", "{}", "solid\n", "ply\n", "v 1 2 3\nf 1 1 1\n", "v 0 0 0\nf 1 2 3\n"}) {
      const auto result = import_reference(write(name, content));
      ASSERT_FALSE(result.ok()) << name << ": " << content;
      EXPECT_EQ(result.error().message.rfind(std::string(name) + ": ", 0), 0U) << describe(result);
      EXPECT_EQ(result.error().field, "path");
    }
  }
  const auto nan = parse("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ReferenceFormat::obj);
  EXPECT_FALSE(nan.ok());
  const auto far = parse("v 0 0 0\nv 1e30 0 0\nv 0 1 0\nf 1 2 3\n", ReferenceFormat::obj);
  EXPECT_EQ(far.ok() ? ErrorCode::internal : far.error().code, ErrorCode::data_corrupt) << describe(far);
  // A header that promises more than follows makes no room for it.
  const auto ply = parse(box_ply("400000000"), ReferenceFormat::ply);
  EXPECT_EQ(ply.ok() ? ErrorCode::internal : ply.error().code, ErrorCode::data_corrupt) << describe(ply);
}

TEST(Reference, LimitsHold) {
  ReferenceOptions options;
  options.max_triangles = 11;
  for (const auto& [text, format] :
       {std::pair{box_obj(), ReferenceFormat::obj}, std::pair{box_stl(), ReferenceFormat::stl},
        std::pair{box_ply(), ReferenceFormat::ply}}) {
    const auto mesh = parse(text, format, options);
    EXPECT_EQ(mesh.ok() ? ErrorCode::internal : mesh.error().code, ErrorCode::resource_exhausted);
  }
  options = {};
  options.max_vertices = 7;
  EXPECT_EQ(parse(box_obj(), ReferenceFormat::obj, options).error().code, ErrorCode::resource_exhausted);
  options = {};
  options.max_file_bytes = 100;
  EXPECT_EQ(parse(box_obj(), ReferenceFormat::obj, options).error().code, ErrorCode::resource_exhausted);
  options = {};
  options.scale = -1;
  EXPECT_EQ(parse(box_obj(), ReferenceFormat::obj, options).error().field, "scale");
  options = {};
  options.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(parse(box_obj(), ReferenceFormat::obj, options).error().field, "translation");
}

}  // namespace
}  // namespace handloft::exchange
