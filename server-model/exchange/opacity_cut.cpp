#include "server-model/exchange/opacity_cut.h"

#include <array>
#include <map>
#include <optional>
#include <utility>

namespace handloft::exchange {

using geometry::TriangleMesh;

namespace {

class Cutter {
 public:
  Cutter(const TriangleMesh& mesh, double opacity)
      : mesh_(mesh), opacity_(opacity), kept_(mesh.vertex_count()) {}

  TriangleMesh cut() {
    for (std::size_t t = 0; t < mesh_.triangle_count(); ++t) {
      cut_triangle({mesh_.indices[3 * t], mesh_.indices[3 * t + 1], mesh_.indices[3 * t + 2]});
    }
    return std::move(result_);
  }

 private:
  bool inside(std::uint32_t vertex) const { return mesh_.opacity[vertex] >= opacity_; }

  // The corners of what is left, in turn: none, three or four.
  void cut_triangle(const std::array<std::uint32_t, 3>& corners) {
    std::array<std::uint32_t, 4> polygon{};
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t here = corners[k];
      const std::uint32_t next = corners[(k + 1) % 3];
      if (inside(here)) polygon[count++] = keep(here);
      if (inside(here) != inside(next)) polygon[count++] = cross(here, next);
    }
    for (std::size_t k = 2; k < count; ++k) {
      const std::array<std::uint32_t, 3> triangle = {polygon[0], polygon[k - 1], polygon[k]};
      result_.indices.insert(result_.indices.end(), triangle.begin(), triangle.end());
    }
  }

  std::uint32_t keep(std::uint32_t vertex) {
    std::optional<std::uint32_t>& index = kept_[vertex];
    if (!index) index = append(mesh_.positions[vertex], mesh_.normals[vertex], mesh_.opacity[vertex]);
    return *index;
  }

  // The same for both triangles at the edge.
  std::uint32_t cross(std::uint32_t a, std::uint32_t b) {
    if (a > b) std::swap(a, b);
    const auto found = crossings_.find({a, b});
    if (found != crossings_.end()) return found->second;
    const double from = mesh_.opacity[a];
    const double share = (opacity_ - from) / (mesh_.opacity[b] - from);
    const double t = share >= 0 && share <= 1 ? share : 0.5;
    const geometry::Vec3 position = mesh_.positions[a] + t * (mesh_.positions[b] - mesh_.positions[a]);
    const geometry::Vec3 normal = (mesh_.normals[a] + t * (mesh_.normals[b] - mesh_.normals[a])).normalized();
    const std::uint32_t index = append(position, normal, opacity_);
    crossings_.emplace(std::pair{a, b}, index);
    return index;
  }

  std::uint32_t append(const geometry::Vec3& position, const geometry::Vec3& normal, double opacity) {
    result_.positions.push_back(position);
    result_.normals.push_back(normal);
    result_.opacity.push_back(opacity);
    return static_cast<std::uint32_t>(result_.positions.size() - 1);
  }

  const TriangleMesh& mesh_;
  double opacity_;
  TriangleMesh result_;
  std::vector<std::optional<std::uint32_t>> kept_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> crossings_;
};

}  // namespace

TriangleMesh cut_at_opacity(const TriangleMesh& mesh, double opacity) {
  return Cutter(mesh, opacity).cut();
}

}  // namespace handloft::exchange
