// Distance of points to a reference (A28): the tree against looking at every triangle.

#include <benchmark/benchmark.h>

#include <random>

#include "server-model/geometry/mesh_distance.h"
#include "tests/unit/server-model/geometry/test_meshes.h"

namespace handloft::geometry {
namespace {

/// Near the mesh and in order, as the vertices of a surface come.
std::vector<Vec3> near_points(std::size_t n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-0.01, 0.01);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(n);
    const Vec3 on(std::sin(3.0 * t) * std::cos(200.0 * t), std::sin(3.0 * t) * std::sin(200.0 * t),
                  std::cos(3.0 * t));
    points.push_back((0.1 + uniform(random)) * on);
  }
  return points;
}

/// Arguments: points, times that the sphere's triangles are divided (20 * 4^times triangles).
void tree(benchmark::State& state) {
  const test::Triangles sphere = test::sphere(0.1, static_cast<int>(state.range(1)));
  const auto mesh = MeshDistance::create(sphere.positions, sphere.indices);
  const std::vector<Vec3> points = near_points(static_cast<std::size_t>(state.range(0)));
  std::vector<double> distances(points.size());
  for (auto _ : state) {
    if (!mesh->signed_distances(points, distances).ok()) state.SkipWithError("refused");
    benchmark::DoNotOptimize(distances.data());
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(tree)
    ->Args({1000, 3})
    ->Args({1000, 5})
    ->Args({100000, 5})
    ->Args({100000, 7})
    ->Unit(benchmark::kMillisecond);

void every_triangle(benchmark::State& state) {
  const test::Triangles sphere = test::sphere(0.1, static_cast<int>(state.range(1)));
  std::vector<MeshDistance> triangles;
  for (std::size_t i = 0; i < sphere.indices.size(); i += 3) {
    const std::vector<Vec3> corners{sphere.positions[sphere.indices[i]],
                                    sphere.positions[sphere.indices[i + 1]],
                                    sphere.positions[sphere.indices[i + 2]]};
    triangles.push_back(*MeshDistance::create(corners, std::vector<std::uint32_t>{0, 1, 2}));
  }
  const std::vector<Vec3> points = near_points(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) {
    for (const Vec3& p : points) {
      double best = 1e300;
      for (const MeshDistance& triangle : triangles) {
        best = std::min(best, std::abs(triangle.nearest(p).signed_distance_m));
      }
      benchmark::DoNotOptimize(best);
    }
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(every_triangle)->Args({1000, 3})->Unit(benchmark::kMillisecond);

void prepare(benchmark::State& state) {
  const test::Triangles sphere = test::sphere(0.1, static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(MeshDistance::create(sphere.positions, sphere.indices).ok());
}
BENCHMARK(prepare)->Arg(5)->Arg(7)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace handloft::geometry
