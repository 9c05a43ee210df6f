// What a drag costs a viewer's line: a sculpted surface of some 10,000 vertices that a hand drags by an icon
// at 60 frames a second, through the model's actor and a viewer's messages, against vertices as raw float32;
// and how far what arrives is from the exact surface.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "common/codec/mesh_codec.h"
#include "common/net/framing.h"
#include "server-model/geometry/bspline_projection.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/session/model_actor.h"
#include "server-model/stream/viewer.h"
#include "tests/support/build_kind.h"
#include "tests/support/hand_script.h"

namespace handloft::session {
namespace {

using Eigen::Vector3d;

constexpr int frames_per_s = 60;
constexpr int parts = 100;  ///< 101 x 101 vertices.
constexpr double table_z = 0.1;
const Vector3d held_at(0.05, 0.02, table_z);

/// A seat's worth of icons on a sheet of 0.4 m x 0.3 m.
model::Model sheet() {
  model::Model model;
  v1::Operation operation;
  v1::CreateSculptSurface& create = *operation.mutable_create_sculpt_surface();
  create.set_id("sheet");
  create.mutable_rectangle()->mutable_pose()->mutable_position()->set_z(table_z);
  create.mutable_rectangle()->mutable_pose()->mutable_orientation()->set_w(1);
  create.mutable_rectangle()->set_width_m(0.4);
  create.mutable_rectangle()->set_depth_m(0.3);
  create.set_control_u(24);
  create.set_control_v(20);
  EXPECT_TRUE(model.submit(operation).ok());
  for (const Vector3d& place :
       {held_at, Vector3d(-0.12, 0.0, table_z), Vector3d(0.12, 0.1, table_z), Vector3d(0.1, -0.1, table_z)}) {
    v1::Operation add;
    add.mutable_add_icon()->set_entity("sheet");
    v1::Vec3& at = *add.mutable_add_icon()->add_places();
    at.set_x(place.x());
    at.set_y(place.y());
    at.set_z(place.z());
    add.mutable_add_icon()->set_role(v1::ICON_CONSTRAINT);
    add.mutable_add_icon()->set_property(v1::ICON_POSITION);
    add.mutable_add_icon()->add_sensors("hand");
    const auto added = model.submit(add);
    EXPECT_TRUE(added.ok()) << added.error().describe();
  }
  return model;
}

struct Distances {
  double vertex_m = 0, triangle_m = 0;
};

/// The largest of vertices and of the middles of triangles to the exact surface.
Distances distances(const codec::MeshData& mesh, const geometry::BSplineSurface& exact) {
  Distances largest;
  const auto projector = geometry::SurfaceProjector::create(exact);
  EXPECT_TRUE(projector.ok());
  const auto distance = [&](const Vector3d& place) { return projector->closest(place).value().distance_m; };
  const auto vertex = [&](std::uint32_t index) {
    const auto& at = mesh.positions.at(index);
    return Vector3d(at[0], at[1], at[2]);
  };
  for (std::uint32_t i = 0; i < mesh.positions.size(); i += 7)
    largest.vertex_m = std::max(largest.vertex_m, distance(vertex(i)));
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3 * 17) {
    const Vector3d middle =
        (vertex(mesh.indices[i]) + vertex(mesh.indices[i + 1]) + vertex(mesh.indices[i + 2])) / 3;
    largest.triangle_m = std::max(largest.triangle_m, distance(middle));
  }
  return largest;
}

TEST(DragBytes, ADragCostsAFractionOfRawFloatsWithinATenthOfAMillimetre) {
  ManualClock clock;
  clock.set(from_ns(1'000'000'000'000));
  ActorOptions options;
  options.meshes.sculpting.least_parts = parts;
  ModelActor actor(sheet(), options, {}, clock, Logger("test", LogLevel::off));
  test::HandScript script;
  stream::Viewer viewer;
  codec::MeshData mesh;
  std::uint64_t bytes = 0, meshes = 0, topology = 0;
  const auto read = [&] {
    bytes = meshes = 0;
    while (const auto message = viewer.next(*actor.scene())) {
      bytes += (*net::encode_frame(*message))->size();
      const auto& states =
          message->has_snapshot() ? message->snapshot().entities() : message->delta().changed();
      for (const v1::EntityState& state : states) {
        if (!state.has_surface()) continue;
        ++meshes;
        const std::vector<std::uint32_t> indices = mesh.indices;
        auto decoded = codec::decode_mesh(state.surface(), {}, {topology, indices});
        ASSERT_TRUE(decoded.ok()) << decoded.error().describe();
        mesh = *std::move(decoded);
        topology = state.surface().topology();
      }
    }
  };
  const auto show = [&](v1::TrackingFrame frame) {
    clock.advance(std::chrono::nanoseconds(1'000'000'000 / frames_per_s));
    frame.set_capture_time_ns(to_ns(clock.now()));
    actor.push_frame(std::move(frame));
    do (void)actor.state();
    while (!actor.idle());
    read();
  };
  show(script.resting(held_at + Vector3d(0, 0, 0.02)));
  show(script.closed(held_at + Vector3d(0, 0, 0.02)));
  std::uint64_t total = 0, shown = 0;
  Distances largest;
  for (int i = 0; i < frames_per_s; ++i) {
    // Up and about by some centimetres, as quickly as hands do.
    const double turn = 2 * std::numbers::pi * i / frames_per_s;
    const Vector3d way(0.03 * std::sin(turn), 0.02 * std::sin(2 * turn), 0.04 * (1 - std::cos(turn)));
    show(script.closed(held_at + Vector3d(0, 0, 0.02) + way));
    if (i == 0) continue;  // With the triangles, once.
    total += bytes;
    shown += meshes;
    if (i % (test::sanitized ? 30 : 10) != 0) continue;
    const auto exact = model::as_sculpt(actor.scene()->entities.at("sheet").entity);
    const Distances now = distances(mesh, *exact->surface);
    largest.vertex_m = std::max(largest.vertex_m, now.vertex_m);
    largest.triangle_m = std::max(largest.triangle_m, now.triangle_m);
  }
  actor.stop();
  ASSERT_EQ(shown, frames_per_s - 1U) << "every frame is a new surface";
  const double per_s = static_cast<double>(total) / (frames_per_s - 1) * frames_per_s;
  const double vertices = static_cast<double>(mesh.positions.size()) * frames_per_s;
  // What a display reads of a vertex: place, normal, opacity.
  const double raw = vertices * 7 * sizeof(float), places = vertices * 3 * sizeof(float);
  std::cout << mesh.positions.size() << " vertices at " << frames_per_s << " Hz: " << per_s / 1e6
            << " MB/s; raw float32 " << raw / 1e6 << " MB/s, " << raw / per_s
            << " times as much (places alone " << places / per_s << " times); vertices within "
            << largest.vertex_m * 1e3 << " mm, triangles within " << largest.triangle_m * 1e3 << " mm\n";
  EXPECT_GE(mesh.positions.size(), 10'000U);
  EXPECT_GE(places / per_s, 6.0) << "with normals and opacity, against raw places alone";
  EXPECT_LE(largest.vertex_m, 1e-4);
  EXPECT_LE(largest.triangle_m, 1e-4);
}

}  // namespace
}  // namespace handloft::session
