#pragma once
// Scenes and messages of any size for the benchmarks: a gently waved sheet of triangles and fuzzy points
// scattered over it. Deterministic.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include "client-hmd/mirror/scene.h"
#include "common/codec/mesh_codec.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client::bench {

/// The sheet's height at (x, y), as a hand that drags it has it at `phase`.
inline double sheet_height(double x, double y, double phase) {
  return 0.04 + 0.012 * std::sin(25.0 * x + phase) * std::cos(20.0 * y);
}

/// Columns and rows of cells for about `triangles` triangles.
inline std::uint32_t cells_a_side(std::size_t triangles) {
  return std::max(1U,
                  static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(triangles) / 2.0))));
}

inline std::shared_ptr<const SurfaceMesh> sheet(std::size_t triangles, double phase = 0.0) {
  constexpr double side_m = 0.24;
  const std::uint32_t n = cells_a_side(triangles);
  auto mesh = std::make_shared<SurfaceMesh>();
  mesh->topology = 1;
  mesh->vertices.reserve(std::size_t{n + 1} * (n + 1));
  mesh->indices.reserve(std::size_t{6} * n * n);
  for (std::uint32_t j = 0; j <= n; ++j) {
    for (std::uint32_t i = 0; i <= n; ++i) {
      const double x = side_m * (static_cast<double>(i) / n - 0.5),
                   y = side_m * (static_cast<double>(j) / n - 0.5);
      constexpr double h = 1e-4;
      const double dx = (sheet_height(x + h, y, phase) - sheet_height(x - h, y, phase)) / (2 * h);
      const double dy = (sheet_height(x, y + h, phase) - sheet_height(x, y - h, phase)) / (2 * h);
      const double length = std::sqrt(dx * dx + dy * dy + 1.0);
      mesh->vertices.push_back(
          {{static_cast<float>(x), static_cast<float>(y), static_cast<float>(sheet_height(x, y, phase))},
           {static_cast<float>(-dx / length), static_cast<float>(-dy / length),
            static_cast<float>(1.0 / length)},
           1.0F});
    }
  }
  for (std::uint32_t j = 0; j < n; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      mesh->indices.insert(mesh->indices.end(), {a, b, c, c, b, d});
    }
  }
  return mesh;
}

/// Over the sheet by the golden ratio's sequence, of sixteen certainties.
inline std::shared_ptr<const PointSet> scattered_points(std::size_t count) {
  auto set = std::make_shared<PointSet>();
  constexpr std::uint32_t levels = 16;
  for (std::uint32_t i = 0; i < levels; ++i)
    set->styles.push_back(test::fuzzy_style(0.4 + 0.58 * i / (levels - 1)));
  set->points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 0.24 * (std::fmod(0.754877666 * static_cast<double>(i), 1.0) - 0.5);
    const double y = 0.24 * (std::fmod(0.569840291 * static_cast<double>(i), 1.0) - 0.5);
    set->points.push_back(
        {{static_cast<float>(x), static_cast<float>(y), static_cast<float>(sheet_height(x, y, 0.0) + 0.002)},
         static_cast<std::uint32_t>(i) % levels});
  }
  return set;
}

/// Either may be null.
inline std::shared_ptr<const Scene> scene_of(std::shared_ptr<const SurfaceMesh> surface,
                                             std::shared_ptr<const PointSet> points) {
  auto scene = std::make_shared<Scene>();
  if (surface == nullptr && points == nullptr) return scene;
  auto entity = std::make_shared<Entity>();
  entity->id = entity->name = "sheet";
  entity->representation = Representation::both;
  entity->surface = std::move(surface);
  entity->points = std::move(points);
  entity->settled_points =
      entity->points == nullptr ? 0 : static_cast<std::uint32_t>(entity->points->points.size());
  scene->entities.emplace(entity->id, std::move(entity));
  return scene;
}

/// The sheet as a server sends it.
inline codec::MeshData sheet_data(std::size_t triangles, double phase) {
  codec::MeshData data;
  const auto mesh = sheet(triangles, phase);
  for (const SurfaceVertex& vertex : mesh->vertices) {
    data.positions.push_back({vertex.position.x, vertex.position.y, vertex.position.z});
    data.normals.push_back({vertex.normal.x, vertex.normal.y, vertex.normal.z});
    data.opacity.push_back(255);
  }
  data.indices = mesh->indices;
  return data;
}

}  // namespace handloft::client::bench
