#include "server-model/model/reference_shape.h"

namespace handloft::model {

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
