// What a vertex of the meshes of a scene costs on the wire, and packing and unpacking it: as residuals
// (PROTOCOL.md, "Meshes"), against meshoptimizer's vertex codec, which viewers of protocol 1.2 are sent, and
// raw float32 (28 bytes: place, normal, opacity). For a grid in rows (0), a trimmed face (1) and a fitted
// surface (2). Counter bytes: a vertex, without the triangles.

#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "common/codec/mesh_codec.h"
#include "server-model/model/model.h"
#include "server-model/stream/mesh_cache.h"
#include "server-model/stream/sculpt_mesher.h"

namespace handloft::stream {
namespace {

using geometry::BSplineSurface;
using geometry::KnotVector;

std::shared_ptr<const BSplineSurface> hood() {
  BSplineSurface sheet{KnotVector::uniform(3, 24).value(), KnotVector::uniform(3, 20).value(), {}, {}};
  for (int i = 0; i < sheet.u.control_count(); ++i)
    for (int j = 0; j < sheet.v.control_count(); ++j) {
      const double u = sheet.u.greville(i), v = sheet.v.greville(j);
      sheet.control.emplace_back(0.4 * u, 0.3 * v, 0.05 * std::sin(5 * u) * std::cos(4 * v));
    }
  return std::make_shared<const BSplineSurface>(sheet);
}

v1::Mesh sculpted(bool trimmed) {
  model::SculptShape shape;
  shape.surface = shape.rest = shape.initial = hood();
  if (trimmed) {
    constexpr int corners = 40;
    model::TrimSpline rim{KnotVector::uniform(1, corners + 1).value(), {}, {}};
    for (int i = 0; i <= corners; ++i) {
      const double turn = 2 * std::numbers::pi * i / corners;
      rim.control.emplace_back(0.5 + 0.4 * std::cos(turn), 0.5 + 0.3 * std::sin(turn));
    }
    rim.control.back() = rim.control.front();
    shape.trim = std::make_shared<const model::FaceTrim>(model::FaceTrim{{rim}});
  }
  SculptMeshOptions options;
  options.least_parts = 100;
  return SculptMesher::create(shape, 1, options).value().pack().value();
}

v1::Mesh fitted() {
  model::Model model;
  v1::Operation operation;
  v1::AddPoints& add = *operation.mutable_add_points();
  add.set_entity("bowl");
  add.mutable_create();
  constexpr int side = 15;
  for (int i = -side; i <= side; ++i)
    for (int j = -side; j <= side; ++j) {
      v1::Point& point = *add.add_points();
      const double x = 0.01 * i, y = 0.01 * j;
      point.mutable_position()->set_x(x);
      point.mutable_position()->set_y(y);
      point.mutable_position()->set_z(2 * x * x - 3 * y * y + 9 * x * x * y);
      point.set_pressure(0.5);
    }
  (void)model.submit(operation).value();
  operation.Clear();
  operation.mutable_fit()->set_entity("bowl");
  (void)model.submit(operation).value();
  return surface_mesh(*model::as_dual(model.document().entities.at("bowl"))).value();
}

v1::Mesh mesh_of(std::int64_t kind) {
  return kind == 2 ? fitted() : sculpted(kind == 1);
}
constexpr std::int64_t kinds = 3;

std::size_t vertex_bytes(const v1::Mesh& mesh) {
  return mesh.residuals().size() + mesh.positions().size() + mesh.normals().size() + mesh.opacity().size();
}

void count(benchmark::State& state, const v1::Mesh& mesh) {
  state.counters["vertices"] = static_cast<double>(mesh.vertex_count());
  state.counters["bytes"] = static_cast<double>(vertex_bytes(mesh)) / mesh.vertex_count();
}

void pack_residuals(benchmark::State& state) {
  const codec::MeshData mesh = codec::decode_mesh(mesh_of(state.range(0))).value();
  v1::Mesh packed;
  for (auto _ : state) packed = codec::encode_mesh(mesh).value();
  count(state, packed);
}

void unpack_residuals(benchmark::State& state) {
  const v1::Mesh packed = mesh_of(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(codec::decode_mesh(packed).value().positions.data());
  count(state, packed);
}

void baseline_unpack_vertex_streams(benchmark::State& state) {
  const v1::Mesh packed = codec::as_vertex_streams(mesh_of(state.range(0))).value();
  for (auto _ : state) benchmark::DoNotOptimize(codec::decode_mesh(packed).value().positions.data());
  count(state, packed);
}

BENCHMARK(pack_residuals)->DenseRange(0, kinds - 1)->Unit(benchmark::kMillisecond);
BENCHMARK(unpack_residuals)->DenseRange(0, kinds - 1)->Unit(benchmark::kMillisecond);
BENCHMARK(baseline_unpack_vertex_streams)->DenseRange(0, kinds - 1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace handloft::stream
