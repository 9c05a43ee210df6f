// Meshes on the wire: quantisation, and that a hostile message is refused by name.

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "common/codec/mesh_codec.h"

namespace handloft::codec {
namespace {

using ::testing::HasSubstr;

/// A saddle over a square of 8 x 8 vertices.
MeshData saddle() {
  MeshData mesh;
  constexpr int side = 8;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const float x = 0.01F * static_cast<float>(i) - 0.03F;
      const float y = 0.01F * static_cast<float>(j) + 0.2F;
      mesh.positions.push_back({x, y, x * y});
      const float length = std::sqrt(1.0F + x * x + y * y);
      mesh.normals.push_back({-y / length, -x / length, 1.0F / length});
      mesh.opacity.push_back(static_cast<std::uint8_t>(4 * (i + j * side)));
    }
  }
  for (std::uint32_t j = 0; j + 1 < side; ++j) {
    for (std::uint32_t i = 0; i + 1 < side; ++i) {
      const std::uint32_t a = i + j * side;
      for (const std::uint32_t index : {a, a + 1, a + side, a + 1, a + side + 1, a + side})
        mesh.indices.push_back(index);
    }
  }
  return mesh;
}

v1::Mesh packed() {
  return *encode_mesh(saddle());
}

TEST(MeshCodecTest, positions_come_back_within_half_a_step_and_the_rest_as_it_was) {
  const MeshData mesh = saddle();
  const auto message = encode_mesh(mesh);
  ASSERT_TRUE(message.ok());
  EXPECT_NEAR(message->step_m(), 0.07 / 65535.0, 1e-9);  // the longest side of the box in 16 bits
  const auto back = decode_mesh(*message);
  ASSERT_TRUE(back.ok()) << back.error().describe();
  ASSERT_EQ(back->positions.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(back->positions[i][axis], mesh.positions[i][axis], 0.5 * message->step_m() + 3e-8);
    }
    double cosine = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cosine += static_cast<double>(back->normals[i][axis]) * static_cast<double>(mesh.normals[i][axis]);
    }
    EXPECT_GT(cosine, std::cos(0.1 * M_PI / 180.0));
  }
  EXPECT_EQ(back->opacity, mesh.opacity);
  ASSERT_EQ(back->indices.size(), mesh.indices.size());
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {  // corners may be rotated, the winding not
    const std::uint32_t* before = &mesh.indices[t];
    const std::uint32_t* after = &back->indices[t];
    bool rotated = false;
    for (int r = 0; r < 3; ++r) {
      rotated |= after[0] == before[r] && after[1] == before[(r + 1) % 3] && after[2] == before[(r + 2) % 3];
    }
    EXPECT_TRUE(rotated) << "triangle " << t / 3;
  }
}

TEST(MeshCodecTest, D21_triangles_can_be_those_of_an_earlier_message) {
  MeshData mesh = saddle();
  v1::Mesh first = packed();
  first.set_topology(9);
  for (auto& place : mesh.positions) place[2] += 0.01F;
  mesh.indices.clear();
  auto second = encode_mesh(mesh, first);
  ASSERT_TRUE(second.ok()) << second.error().describe();
  EXPECT_EQ(second->indices(), first.indices());
  EXPECT_EQ(second->topology(), 9U);
  const auto before = decode_mesh(first);
  ASSERT_TRUE(before.ok());
  second->clear_indices();
  EXPECT_EQ(decode_mesh(*second).error().field, "indices") << "nobody knows them";
  const auto after = decode_mesh(*second, {}, {9, before->indices});
  ASSERT_TRUE(after.ok()) << after.error().describe();
  EXPECT_EQ(after->indices, before->indices);
  EXPECT_NEAR(after->positions[5][2], before->positions[5][2] + 0.01F, 1e-5F);
  EXPECT_EQ(decode_mesh(*second, {}, {8, before->indices}).error().field, "indices");

  mesh.positions.pop_back(), mesh.normals.pop_back(), mesh.opacity.pop_back();
  EXPECT_EQ(encode_mesh(mesh, first).error().field, "positions") << "fewer than the triangles ask for";
}

TEST(MeshCodecTest, U4_rows_of_a_grid_pack_better_and_unpack_to_the_same) {
  MeshData mesh = saddle();
  mesh.row = 8;
  const v1::Mesh in_rows = *encode_mesh(mesh), in_none = packed();
  EXPECT_LT(in_rows.residuals().size(), in_none.residuals().size());
  const auto a = decode_mesh(in_rows), b = decode_mesh(in_none);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->positions, b->positions);
  EXPECT_EQ(a->normals, b->normals);
  EXPECT_EQ(a->row, 8U) << "packed again, it packs as well";
  for (const std::uint32_t row : {1U, 5U, 63U, 64U}) {  // No grid, and rows that are not full.
    mesh.row = row;
    const auto back = decode_mesh(*encode_mesh(mesh));
    ASSERT_TRUE(back.ok()) << row;
    EXPECT_EQ(back->positions, b->positions) << row;
    EXPECT_EQ(back->normals, b->normals) << row;
  }
  mesh.row = 65;
  EXPECT_EQ(encode_mesh(mesh).error().field, "row");
}

TEST(MeshCodecTest, a_mesh_that_is_opaque_throughout_says_nothing_of_it) {
  MeshData mesh = saddle();
  mesh.opacity.assign(mesh.positions.size(), 255);
  const v1::Mesh message = *encode_mesh(mesh);
  EXPECT_TRUE(message.opacity().empty());
  EXPECT_EQ(decode_mesh(message)->opacity, mesh.opacity);
}

TEST(MeshCodecTest, older_viewers_are_given_the_same_numbers) {
  for (const bool opaque : {false, true}) {
    MeshData mesh = saddle();
    if (opaque) mesh.opacity.assign(mesh.positions.size(), 255);
    const v1::Mesh message = *encode_mesh(mesh);
    const auto plain = as_vertex_streams(message);
    ASSERT_TRUE(plain.ok()) << plain.error().describe();
    EXPECT_TRUE(plain->residuals().empty());
    EXPECT_EQ(plain->opacity().size(), mesh.positions.size());
    const auto a = decode_mesh(message), b = decode_mesh(*plain);
    ASSERT_TRUE(a.ok() && b.ok()) << b.error().describe();
    EXPECT_EQ(a->positions, b->positions);
    EXPECT_EQ(a->normals, b->normals);
    EXPECT_EQ(a->opacity, b->opacity);
    EXPECT_EQ(a->indices, b->indices);
  }
}

TEST(MeshCodecTest, is_smaller_than_the_numbers) {
  const MeshData mesh = saddle();
  EXPECT_LT(packed().ByteSizeLong(), (mesh.positions.size() * 25 + mesh.indices.size() * 4) / 3);
}

TEST(MeshCodecTest, octahedral_axes_are_exact_and_zero_is_up) {
  for (const std::array<float, 3>& axis :
       {std::array<float, 3>{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}) {
    const auto [x, y] = encode_octahedral(axis);
    const auto back = decode_octahedral(x, y);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(back[i], axis[i], 1e-6);
  }
  EXPECT_EQ(encode_octahedral({0, 0, 0}), (std::array<std::int16_t, 2>{0, 0}));
}

TEST(MeshCodecTest, an_empty_mesh_and_a_single_point_pass) {
  const auto nothing = decode_mesh(*encode_mesh({}));
  ASSERT_TRUE(nothing.ok());
  EXPECT_TRUE(nothing->positions.empty());
  const auto point = decode_mesh(*encode_mesh({{{1, 2, 3}}, {{0, 0, 1}}, {200}, {}}));
  ASSERT_TRUE(point.ok()) << point.error().describe();
  EXPECT_EQ(point->positions[0], (std::array<float, 3>{1, 2, 3}));
}

TEST(MeshCodecTest, the_encoder_names_what_is_wrong) {
  MeshData mesh = saddle();
  mesh.positions[3][1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(encode_mesh(mesh).error().field, "positions[3][1]");
  mesh = saddle();
  mesh.indices[4] = 64;
  EXPECT_EQ(encode_mesh(mesh).error().field, "indices[4]");
  mesh = saddle();
  mesh.indices.pop_back();
  EXPECT_EQ(encode_mesh(mesh).error().field, "indices");
  mesh = saddle();
  mesh.normals.pop_back();
  EXPECT_EQ(encode_mesh(mesh).error().field, "normals");
  EXPECT_EQ(encode_mesh(saddle(), {.max_vertices = 63}).error().code, ErrorCode::resource_exhausted);
}

TEST(MeshCodecTest, the_decoder_names_what_is_wrong) {
  const auto field = [](const v1::Mesh& message) {
    const auto result = decode_mesh(message);
    return result.ok() ? std::string("accepted") : result.error().field;
  };
  v1::Mesh message = packed();
  ASSERT_EQ(field(message), "accepted");
  message.set_vertex_count(0xffffffffU);
  EXPECT_EQ(field(message), "vertex_count");
  message = packed();
  message.set_vertex_count(1U << 19);  // within the limit, but without the bytes
  EXPECT_EQ(field(message), "opacity");
  message = packed();
  message.set_index_count(3U << 20);
  EXPECT_EQ(field(message), "indices");
  message = packed();
  message.set_index_count(7);
  EXPECT_EQ(field(message), "index_count");
  for (const std::string& residuals :
       {packed().residuals().substr(0, 40), packed().residuals() + "x",
        packed().residuals() + packed().residuals(), std::string("not packed by anything"),
        encode_mesh({{{1, 2, 3}}, {{0, 0, 1}}, {200}, {}})->residuals()}) {
    message = packed();
    message.set_residuals(residuals);
    EXPECT_EQ(field(message), "residuals") << residuals.size();
  }
  message = packed();
  message.mutable_residuals()->back() ^= 0x55;
  EXPECT_NE(field(message), "indices") << "other vertices, or none";
  message = packed();
  message.set_row(65);
  EXPECT_EQ(field(message), "row");
  message = packed();
  message.clear_residuals();
  EXPECT_EQ(field(message), "positions");
  const v1::Mesh plain = *as_vertex_streams(packed());
  message = plain;
  message.mutable_positions()->resize(10);
  EXPECT_EQ(field(message), "positions");
  message = plain;
  message.set_normals("\xa0");
  EXPECT_EQ(field(message), "normals");
  message = plain;
  message.clear_opacity();
  EXPECT_EQ(field(message), "opacity");
  message = packed();
  message.set_step_m(-1.0);
  EXPECT_EQ(field(message), "step_m");
  message = packed();
  message.mutable_origin()->set_z(std::numeric_limits<double>::infinity());
  EXPECT_EQ(field(message), "origin.z");
  v1::Mesh fewer = *encode_mesh(
      {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}, {9, 9, 9}, {0, 1, 2}});
  message = packed();
  fewer.set_index_count(message.index_count());
  fewer.set_indices(message.indices());  // triangles of a larger mesh
  EXPECT_THAT(field(fewer), HasSubstr("indices["));
}

}  // namespace
}  // namespace handloft::codec
