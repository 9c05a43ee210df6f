// What is under the pointer, of a million triangles (V6): the first look after the mesh has changed, and
// every further one; beside looking at every triangle.

#include <benchmark/benchmark.h>

#include <cmath>

#include "client-hmd/desktop/picker.h"
#include "client-hmd/view/orbit_camera.h"

namespace handloft::client {
namespace {

std::shared_ptr<const SurfaceMesh> hills(int side) {
  auto mesh = std::make_shared<SurfaceMesh>();
  for (int i = 0; i <= side; ++i) {
    for (int k = 0; k <= side; ++k) {
      const float x = -0.1F + 0.2F * static_cast<float>(i) / static_cast<float>(side);
      const float y = -0.1F + 0.2F * static_cast<float>(k) / static_cast<float>(side);
      SurfaceVertex vertex;
      vertex.position = {x, y, 0.05F + 0.01F * std::sin(40.0F * x) * std::cos(35.0F * y)};
      vertex.normal = {0.0F, 0.0F, 1.0F};
      mesh->vertices.push_back(vertex);
    }
  }
  const auto at = [side](int i, int k) { return static_cast<std::uint32_t>(i * (side + 1) + k); };
  for (int i = 0; i < side; ++i) {
    for (int k = 0; k < side; ++k) {
      for (const std::uint32_t index :
           {at(i, k), at(i + 1, k), at(i, k + 1), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)}) {
        mesh->indices.push_back(index);
      }
    }
  }
  return mesh;
}

constexpr int million = 708;  // 2 x 708^2 triangles.

Ray ray_at(int i) {
  return ray_through(OrbitCamera().eye(1280, 720), {400.0 + 5.0 * (i % 80), 250.0 + 3.0 * (i % 50)});
}

void first_look(benchmark::State& state) {
  const auto mesh = hills(million);
  for (auto _ : state) benchmark::DoNotOptimize(MeshIndex(mesh).meet(ray_at(7)));
}
BENCHMARK(first_look)->Unit(benchmark::kMillisecond);

void further_look(benchmark::State& state) {
  const MeshIndex index(hills(million));
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(index.meet(ray_at(++i)));
}
BENCHMARK(further_look)->Unit(benchmark::kMicrosecond);

/// The baseline: a box of no use about all of it is what a mesh in no order has.
void every_triangle(benchmark::State& state) {
  auto mesh = std::make_shared<SurfaceMesh>(*hills(million));
  for (std::size_t t = 0; t + 3 < mesh->indices.size() / 2; t += 3) {
    for (std::size_t c = 0; c < 3; ++c) {
      std::swap(mesh->indices[t + c], mesh->indices[(t * 7919) % (mesh->indices.size() - 3) / 3 * 3 + c]);
    }
  }
  const MeshIndex index(mesh);
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(index.meet(ray_at(++i)));
}
BENCHMARK(every_triangle)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace handloft::client
