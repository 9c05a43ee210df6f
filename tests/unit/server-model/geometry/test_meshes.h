#pragma once
// Closed meshes whose distances are known: a box and a sphere of triangles.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "server-model/geometry/types.h"

namespace handloft::geometry::test {

struct Triangles {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
};

/// Axis-aligned, centred at the origin, twelve triangles, normals outwards.
inline Triangles box(const Vec3& half) {
  Triangles mesh;
  for (unsigned corner = 0; corner < 8; ++corner) {
    mesh.positions.emplace_back((corner & 1U) != 0 ? half.x() : -half.x(),
                                (corner & 2U) != 0 ? half.y() : -half.y(),
                                (corner & 4U) != 0 ? half.z() : -half.z());
  }
  mesh.indices = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                  2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return mesh;
}

/// An icosahedron whose triangles are divided into four `times` times, all vertices on the sphere.
inline Triangles sphere(double radius, int times, const Vec3& centre = Vec3::Zero()) {
  const double g = (1.0 + std::sqrt(5.0)) / 2.0;
  Triangles mesh;
  mesh.positions = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                    {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.indices = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                  4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                  6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
  for (int time = 0; time < times; ++time) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [found, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
      if (fresh)
        mesh.positions.emplace_back(0.5 * (mesh.positions[a].normalized() + mesh.positions[b].normalized()));
      return found->second;
    };
    std::vector<std::uint32_t> finer;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const std::uint32_t a = mesh.indices[i];
      const std::uint32_t b = mesh.indices[i + 1];
      const std::uint32_t c = mesh.indices[i + 2];
      const std::uint32_t ab = middle(a, b);
      const std::uint32_t bc = middle(b, c);
      const std::uint32_t ca = middle(c, a);
      finer.insert(finer.end(), {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca});
    }
    mesh.indices = std::move(finer);
  }
  for (Vec3& p : mesh.positions) p = centre + radius * p.normalized();
  return mesh;
}

}  // namespace handloft::geometry::test
