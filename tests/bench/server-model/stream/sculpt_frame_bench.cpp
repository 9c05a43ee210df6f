// One frame of a drag as issue 4 has it: 159 x 81 control points, 32 point constraints, 48,672 polygons (the
// paper's Table 2 has 48,536: two triangles a cell do not give that number of whole spans), from the moved
// constraint to the bytes for a viewer. All, its parts, and what the same frame costs when nothing is kept:
// a tessellation from the beginning, with its triangles packed.

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "server-model/geometry/bspline_tessellate.h"
#include "server-model/geometry/sculpt_system.h"
#include "server-model/stream/sculpt_mesher.h"

namespace handloft::stream {
namespace {

using geometry::BSplineSurface;
using geometry::GridParameters;
using geometry::KnotVector;
using geometry::Vec2;
using geometry::Vec3;

constexpr int constraints = 32;
constexpr int dragged = 16;
constexpr int parts_along_u = 2;

class Drag {
 public:
  Drag() {
    BSplineSurface sheet{KnotVector::uniform(3, 159).value(), KnotVector::uniform(3, 81).value(), {}, {}};
    for (int i = 0; i < sheet.u.control_count(); ++i)
      for (int j = 0; j < sheet.v.control_count(); ++j) {
        const double u = sheet.u.greville(i), v = sheet.v.greville(j);
        sheet.control.emplace_back(1.5 * u, v, 0.1 * std::sin(3 * u) * std::cos(2 * v));
      }
    grid = {geometry::even_grid(sheet, parts_along_u).us, geometry::even_grid(sheet, 1).vs};
    shape.surface = shape.rest = shape.initial = std::make_shared<const BSplineSurface>(sheet);
    for (int i = 0; i < constraints; ++i) {
      const Vec2 uv(std::fmod(0.618034 * (i + 1), 1) * 0.9 + 0.05, (i + 0.5) / (constraints + 1));
      rows.push_back(
          geometry::point_row(sheet, uv, geometry::PointAspect::position, sheet.evaluate(uv.x(), uv.y()))
              .value());
    }
    system.push_back(geometry::SculptSystem::create(sheet, {}).value());
    solve();
  }

  const BSplineSurface& solve() {
    rows[dragged].target += Vec3(0, 1e-5, 1e-4);
    present = *shape.rest;
    present.control = system.front().solve(rows, {}, geometry::ConflictPolicy::refuse).value().control;
    return present;
  }

  model::SculptShape shape;
  GridParameters grid;
  BSplineSurface present{KnotVector::uniform(1, 2).value(), KnotVector::uniform(1, 2).value(), {}, {}};

 private:
  std::vector<geometry::SculptRow> rows;
  std::vector<geometry::SculptSystem> system;
};

Drag& drag() {
  static Drag one;
  return one;
}

std::string encoded(v1::Mesh mesh) {
  mesh.clear_indices();  // The viewer has them.
  return mesh.SerializeAsString();
}

void dragged_frame(benchmark::State& state) {
  SculptMesher mesher = SculptMesher::create(drag().shape, 1, drag().grid).value();
  std::size_t bytes = 0, polygons = 0;
  for (auto _ : state) {
    const v1::Mesh mesh = mesher.mesh(drag().solve()).value();
    bytes = encoded(mesh).size();
    polygons = mesh.index_count() / 3;
  }
  state.counters["polygons"] = static_cast<double>(polygons);
  state.counters["KiB"] = static_cast<double>(bytes) / 1024;
}

void part_solve(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(drag().solve().control.data());
}

void part_evaluate(benchmark::State& state) {
  SculptMesher mesher = SculptMesher::create(drag().shape, 1, drag().grid).value();
  for (auto _ : state) {
    state.PauseTiming();
    const BSplineSurface& surface = drag().solve();
    state.ResumeTiming();
    benchmark::DoNotOptimize(mesher.evaluate(surface).ok());
  }
}

void part_pack(benchmark::State& state) {
  SculptMesher mesher = SculptMesher::create(drag().shape, 1, drag().grid).value();
  benchmark::DoNotOptimize(mesher.evaluate(drag().solve()).ok());
  for (auto _ : state) benchmark::DoNotOptimize(mesher.pack().value());
}

void part_message(benchmark::State& state) {
  SculptMesher mesher = SculptMesher::create(drag().shape, 1, drag().grid).value();
  const v1::Mesh mesh = mesher.mesh(drag().solve()).value();
  for (auto _ : state) benchmark::DoNotOptimize(encoded(mesh));
}

/// The same grid, evaluated and packed from the beginning, triangles and all.
void baseline_same_grid_anew(benchmark::State& state) {
  std::size_t bytes = 0;
  for (auto _ : state) {
    model::SculptShape shape = drag().shape;
    shape.surface = std::make_shared<const BSplineSurface>(drag().solve());
    SculptMesher mesher = SculptMesher::create(shape, 1, drag().grid).value();
    bytes = mesher.pack().value().SerializeAsString().size();
  }
  state.counters["KiB"] = static_cast<double>(bytes) / 1024;
}

/// What was there before: a full adaptive tessellation each time, packed as other meshes.
void baseline_tessellation_anew(benchmark::State& state) {
  std::size_t polygons = 0;
  for (auto _ : state) {
    geometry::SurfaceMeshOptions options;
    options.largest_cell = 1.0 / 64;  // Some 50,000 polygons, as knots are no halves.
    const geometry::TriangleMesh mesh = geometry::tessellate(drag().solve(), options).value();
    codec::MeshData packed;
    const auto floats = [](const Vec3& v) {
      return std::array{static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
    };
    for (const Vec3& place : mesh.positions) packed.positions.push_back(floats(place));
    for (const Vec3& normal : mesh.normals) packed.normals.push_back(floats(normal));
    packed.opacity.assign(mesh.vertex_count(), 255);
    packed.indices = mesh.indices;
    benchmark::DoNotOptimize(codec::encode_mesh(packed).value().SerializeAsString());
    polygons = mesh.triangle_count();
  }
  state.counters["polygons"] = static_cast<double>(polygons);
}

BENCHMARK(dragged_frame)->Unit(benchmark::kMillisecond);
BENCHMARK(part_solve)->Unit(benchmark::kMillisecond);
BENCHMARK(part_evaluate)->Unit(benchmark::kMillisecond);
BENCHMARK(part_pack)->Unit(benchmark::kMillisecond);
BENCHMARK(part_message)->Unit(benchmark::kMillisecond);
BENCHMARK(baseline_same_grid_anew)->Unit(benchmark::kMillisecond);
BENCHMARK(baseline_tessellation_anew)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace handloft::stream
