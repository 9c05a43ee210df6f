// Meshing a surface while a hand shapes it: must fit in a frame of 11 ms many times over (X4). The baseline
// is a grid over the same box, opacity per vertex, with as many vertices as it needs for the same opacity
// error (by its second differences; counter "grid vertices").

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "server-model/geometry/tessellate.h"

namespace handloft::geometry {
namespace {

/// The baseline is not looked for beyond a million vertices.
constexpr std::size_t most_grid_side = 1000;

PolynomialSurface dome() {
  return *PolynomialSurface::from_coefficients(2, std::array{0.02, 0., 0., 0.5, -2., -4.});
}
TrimField oval() {
  return *Superellipse::create({{0, 0}, {0.06, 0.04}}, 2.5);
}
/// A wavy curve of as many places as a hand draws in ten seconds.
TrimField drawn() {
  std::vector<Vec2> curve;
  constexpr int count = 300;
  for (int i = 0; i <= count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    const double radius = 1 + 0.2 * std::cos(5 * angle);
    curve.emplace_back(0.06 * radius * std::cos(angle), 0.04 * radius * std::sin(angle));
  }
  return std::make_shared<const BoundaryTrim>(*BoundaryTrim::create(curve));
}
TrimField trim_of(const benchmark::State& state) {
  return state.range(0) == 0 ? oval() : drawn();
}

TriangleMesh grid(const PolynomialSurface& surface, const TrimField& trim, std::size_t side) {
  const Box2 box = trim.visible_box();
  TriangleMesh mesh;
  mesh.positions.reserve(side * side);
  for (std::size_t i = 0; i < side; ++i) {
    for (std::size_t j = 0; j < side; ++j) {
      const Vec2 unit(static_cast<double>(i), static_cast<double>(j));
      const Vec2 xy = box.lower() + 2 * unit.cwiseProduct(box.half_extent) / static_cast<double>(side - 1);
      mesh.positions.push_back(surface.point(xy.x(), xy.y()));
      mesh.normals.push_back(surface.normal(xy.x(), xy.y()));
      mesh.opacity.push_back(trim.opacity(xy));
      if (i + 1 < side && j + 1 < side) {
        const auto a = static_cast<std::uint32_t>(i * side + j);
        const auto b = static_cast<std::uint32_t>(a + side);
        mesh.indices.insert(mesh.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
      }
    }
  }
  return mesh;
}

/// Largest difference of opacities at triangles' centres and the middles of their sides.
double opacity_error(const TriangleMesh& mesh, const TrimField& trim) {
  double worst = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const std::array c{mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]};
    const auto look = [&](double wa, double wb, double wc) {
      const Vec3 at = wa * mesh.positions[c[0]] + wb * mesh.positions[c[1]] + wc * mesh.positions[c[2]];
      const double t = wa * mesh.opacity[c[0]] + wb * mesh.opacity[c[1]] + wc * mesh.opacity[c[2]];
      worst = std::max(worst, std::abs(t - trim.opacity(at.head<2>())));
    };
    look(1.0 / 3, 1.0 / 3, 1.0 / 3);
    look(0.5, 0.5, 0);
    look(0, 0.5, 0.5);
    look(0.5, 0, 0.5);
  }
  return worst;
}

/// The opacity tolerance that gives about the wanted number of vertices.
TessellationOptions options_for(const TrimField& trim, std::size_t vertices) {
  TessellationOptions options;
  options.max_divisions = 1024;
  options.max_vertices = 2'000'000;
  options.min_divisions = 2;
  options.opacity_tolerance = 1;
  options.chord_tolerance_m = 1e-3;
  for (int i = 0; i < 40; ++i) {
    const auto mesh = tessellate(dome(), Frame{}, trim, options);
    if (mesh->vertex_count() >= vertices) break;
    options.opacity_tolerance /= 1.4;
    options.chord_tolerance_m /= 1.4;
  }
  return options;
}

void adaptive(benchmark::State& state) {
  const TrimField trim = trim_of(state);
  const TessellationOptions options = options_for(trim, static_cast<std::size_t>(state.range(1)));
  TriangleMesh last;
  for (auto _ : state) {
    auto mesh = tessellate(dome(), Frame{}, trim, options);
    benchmark::DoNotOptimize(mesh);
    last = *std::move(mesh);
  }
  state.SetLabel(state.range(0) == 0 ? "superellipse" : "boundary");
  const double error = opacity_error(last, trim);
  state.counters["vertices"] = static_cast<double>(last.vertex_count());
  state.counters["opacity error"] = error;
  std::size_t side = 8;
  while (side < most_grid_side && opacity_error(grid(dome(), trim, side), trim) > error) side += 1 + side / 6;
  state.counters["grid vertices"] = static_cast<double>(side * side);
}
BENCHMARK(adaptive)
    ->ArgNames({"boundary", "vertices"})
    ->ArgsProduct({{0, 1}, {441, 100'000}})
    ->Unit(benchmark::kMicrosecond);

/// The baseline of as many vertices.
void uniform_grid(benchmark::State& state) {
  const TrimField trim = trim_of(state);
  const auto side = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(state.range(1)))));
  TriangleMesh last;
  for (auto _ : state) {
    last = grid(dome(), trim, side);
    benchmark::DoNotOptimize(last);
  }
  state.SetLabel(state.range(0) == 0 ? "superellipse" : "boundary");
  state.counters["vertices"] = static_cast<double>(last.vertex_count());
  state.counters["opacity error"] = opacity_error(last, trim);
}
BENCHMARK(uniform_grid)
    ->ArgNames({"boundary", "vertices"})
    ->ArgsProduct({{0, 1}, {441, 100'000}})
    ->Unit(benchmark::kMicrosecond);

/// As streamed, by default options.
void tessellate_default(benchmark::State& state) {
  const TrimField trim = trim_of(state);
  std::size_t vertices = 0;
  for (auto _ : state) {
    const auto mesh = tessellate(dome(), Frame{}, trim);
    vertices = mesh->vertex_count();
    benchmark::DoNotOptimize(mesh);
  }
  state.SetLabel(state.range(0) == 0 ? "superellipse" : "boundary");
  state.counters["vertices"] = static_cast<double>(vertices);
}
BENCHMARK(tessellate_default)->ArgName("boundary")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

/// Signed distances of 100,000 places to a curve of that many vertices.
void boundary_distance(benchmark::State& state) {
  std::vector<Vec2> curve;
  const auto count = static_cast<int>(state.range(0));
  for (int i = 0; i <= count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    curve.emplace_back(std::cos(angle) * (1 + 0.2 * std::cos(5 * angle)), std::sin(angle));
  }
  const auto trim = BoundaryTrim::create(curve);
  constexpr int side = 316;
  for (auto _ : state) {
    double sum = 0;
    for (int i = 0; i < side; ++i) {
      for (int j = 0; j < side; ++j) sum += trim->opacity({3.0 * i / side - 1.5, 3.0 * j / side - 1.5});
    }
    benchmark::DoNotOptimize(sum);
  }
}
BENCHMARK(boundary_distance)
    ->ArgName("curve")
    ->Arg(100)
    ->Arg(1000)
    ->Arg(10000)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace handloft::geometry
