#pragma once
// Messages as a server would send them, for the tests of the mirror.

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "common/codec/mesh_codec.h"
#include "common/codec/point_codec.h"
#include "proto/scene.pb.h"

namespace handloft::client::test {

/// `count` points along x from index `first` on, of a cloud that then has first + count.
inline v1::PointCloud cloud(std::uint32_t first, std::uint32_t count, double pressure = 0.5) {
  codec::PointTail tail;
  tail.first = first;
  tail.total = first + count;
  codec::FuzzyStyle style;
  style.pressure = pressure;
  style.radius_m = 0.006F;
  style.shell_radius_m = {0.006F, 0.0048F, 0.0036F, 0.0024F, 0.0012F};
  style.shell_alpha = {0.05F, 0.10F, 0.12F, 0.15F, 0.20F};
  tail.palette = {style};
  for (std::uint32_t i = first; i < first + count; ++i) {
    tail.positions.push_back({0.001 * i, 0.0, 0.05});
    tail.styles.push_back(0);
  }
  return *codec::encode_points(tail);
}

/// One right-angled triangle of `side` metres.
inline v1::Mesh triangle(float side = 0.1F) {
  codec::MeshData mesh;
  mesh.positions = {{0, 0, 0.02F}, {side, 0, 0.02F}, {0, side, 0.02F}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  mesh.opacity = {255, 255, 128};
  mesh.indices = {0, 1, 2};
  return *codec::encode_mesh(mesh);
}

inline v1::SceneSnapshot snapshot(std::uint32_t points = 3) {
  v1::SceneSnapshot message;
  message.set_epoch(7);
  message.set_sequence(1);
  v1::EntityState& top = *message.add_entities();
  top.set_id("top");
  top.set_name("Top");
  top.set_revision(1);
  top.set_selected(true);
  top.set_representation(v1::REPRESENTATION_BOTH);
  *top.mutable_points() = cloud(0, points);
  *top.mutable_surface() = triangle();
  top.set_surface_shown(true);
  message.mutable_history()->set_undo_steps(1);
  return message;
}

/// Numbers as EntityState.distances carries them, on any machine.
inline std::string packed(const std::vector<float>& numbers) {
  std::string bytes;
  for (const float number : numbers) {
    const auto bits = std::bit_cast<std::uint32_t>(number);
    for (unsigned k = 0; k < 4; ++k) bytes.push_back(static_cast<char>(bits >> (8U * k) & 0xFFU));
  }
  return bytes;
}

/// "top" compared with a reference beside it, in the second of two alternatives (A28).
inline v1::SceneSnapshot compared_snapshot() {
  v1::SceneSnapshot message = snapshot();
  v1::EntityState& top = *message.mutable_entities(0);
  top.set_kind("dual_shape");
  top.set_distances(packed({-0.002F, 0.0F, 0.003F}));
  v1::EntityState& board = *message.add_entities();
  board.set_id("board");
  board.set_kind("reference");
  board.set_revision(1);
  board.set_representation(v1::REPRESENTATION_SURFACE);
  *board.mutable_surface() = triangle(0.2F);
  board.set_surface_shown(true);
  message.mutable_alternatives()->set_present("flat");
  message.mutable_alternatives()->add_names("main");
  message.mutable_alternatives()->add_names("flat");
  return message;
}

/// A delta that changes "top", as far as the caller fills it in.
inline v1::SceneDelta delta(std::uint64_t revision = 2, std::uint64_t sequence = 2) {
  v1::SceneDelta message;
  message.set_epoch(7);
  message.set_sequence(sequence);
  v1::EntityState& top = *message.add_changed();
  top.set_id("top");
  top.set_revision(revision);
  top.set_representation(v1::REPRESENTATION_BOTH);
  top.set_surface_shown(true);
  return message;
}

}  // namespace handloft::client::test
