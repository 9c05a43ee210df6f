#include "server-model/exchange/mesh_checks.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace handloft::exchange::detail {
namespace {

/// glTF holds floats: what no float can hold is refused rather than written as infinity.
bool fits_float(const geometry::Vec3& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= static_cast<double>(std::numeric_limits<float>::max());
}

bool is_colour(float red, float green, float blue) {
  const auto unit = [](float x) { return x >= 0 && x <= 1; };
  return unit(red) && unit(green) && unit(blue);
}

Status check_mesh(const MeshExport& item, const std::string& field) {
  const geometry::TriangleMesh& mesh = item.mesh;
  const std::size_t count = mesh.vertex_count();
  if (mesh.indices.empty() || mesh.indices.size() % 3 != 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} indices, expected three per triangle and at least one triangle",
                                  mesh.indices.size()),
                      field + ".indices");
  }
  if (count >= std::numeric_limits<std::uint32_t>::max()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} vertices, more than an index can name", count),
                      field + ".positions");
  }
  if (mesh.normals.size() != count || mesh.opacity.size() != count) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} positions, {} normals and {} opacities, expected as many of each",
                                  count, mesh.normals.size(), mesh.opacity.size()),
                      field + ".normals");
  }
  for (const std::uint32_t index : mesh.indices) {
    if (index >= count) {
      return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected below {}", index, count),
                        field + ".indices");
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!fits_float(mesh.positions[i]) || !fits_float(mesh.normals[i]) ||
        !(mesh.opacity[i] >= 0 && mesh.opacity[i] <= 1)) {
      return make_error(ErrorCode::invalid_argument,
                        "found a number that is not finite, or an opacity outside of 0..1",
                        fmt::format("{}.vertices[{}]", field, i));
    }
  }
  if (!is_colour(item.red, item.green, item.blue)) {
    return make_error(ErrorCode::invalid_argument, "found a colour outside of 0..1", field + ".colour");
  }
  return {};
}

}  // namespace

Status check_meshes(std::span<const MeshExport> meshes) {
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (Status status = check_mesh(meshes[i], fmt::format("meshes[{}]", i)); !status.ok()) return status;
  }
  return {};
}

Status check_clouds(std::span<const PointCloudExport> clouds) {
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    const PointCloudExport& cloud = clouds[i];
    const std::string field = fmt::format("clouds[{}]", i);
    if (cloud.points.empty()) {
      return make_error(ErrorCode::invalid_argument, "found no points, expected at least one",
                        field + ".points");
    }
    if (!is_colour(cloud.red, cloud.green, cloud.blue)) {
      return make_error(ErrorCode::invalid_argument, "found a colour outside of 0..1", field + ".colour");
    }
    for (std::size_t k = 0; k < cloud.points.size(); ++k) {
      const geometry::WeightedPoint& point = cloud.points[k];
      if (!fits_float(point.position) || !(point.weight >= 0 && point.weight <= 1)) {
        return make_error(ErrorCode::invalid_argument,
                          "found a number that is not finite, or a weight outside of 0..1",
                          fmt::format("{}.points[{}]", field, k));
      }
    }
  }
  return {};
}

}  // namespace handloft::exchange::detail
