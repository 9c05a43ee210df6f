#include "server-model/model/reference_shape.h"

#include <algorithm>

namespace handloft::model {

bool ReferenceMesh::has_area() const {
  const auto at = [this](std::uint32_t i) {
    const auto& [x, y, z] = positions[i];
    return geometry::Vec3(double{x}, double{y}, double{z});
  };
  return std::any_of(triangles.begin(), triangles.end(), [&](const std::array<std::uint32_t, 3>& corners) {
    return geometry::MeshDistance::has_area(at(corners[0]), at(corners[1]), at(corners[2]));
  });
}

const geometry::MeshDistance* ReferenceMesh::distance() const {
  std::call_once(prepared_, [this] {
    std::vector<geometry::Vec3> points;
    points.reserve(positions.size());
    for (const auto& [x, y, z] : positions) points.emplace_back(double{x}, double{y}, double{z});
    std::vector<std::uint32_t> indices;
    indices.reserve(3 * triangles.size());
    for (const auto& triangle : triangles) indices.insert(indices.end(), triangle.begin(), triangle.end());
    auto made = geometry::MeshDistance::create(points, indices);
    if (made) distance_ = std::make_unique<const geometry::MeshDistance>(*std::move(made));
  });
  return distance_.get();
}

}  // namespace handloft::model
