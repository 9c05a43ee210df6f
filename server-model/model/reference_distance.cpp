#include "server-model/model/reference_distance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server-model/geometry/tessellate.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace {

namespace v1 = handloft::v1;

Result<ReferencePtr> require_reference(const Document& document, const std::string& id) {
  const std::string field = "distance.reference";
  if (!id.empty()) {
    auto found = require_entity(document, id, field);
    if (!found) return found.error();
    ReferencePtr reference = as_reference(*found);
    if (reference) return reference;
    return make_error(ErrorCode::invalid_argument, fmt::format("\"{}\" is no reference, expected one", id),
                      field);
  }
  ReferencePtr only;
  std::size_t count = 0;
  for (const auto& [each, entity] : document.entities) {
    if (ReferencePtr reference = as_reference(entity)) {
      only = std::move(reference);
      ++count;
    }
  }
  if (count == 1) return only;
  return make_error(ErrorCode::failed_precondition,
                    fmt::format("there are {} references, expected the name of one", count), field);
}

Status measure(const geometry::MeshDistance& mesh, const std::vector<geometry::Vec3>& points,
               v1::DistanceStatistics& out) {
  std::vector<double> distances(points.size());
  if (auto status = mesh.signed_distances(points, distances); !status) return status;
  double sum = 0;
  double squares = 0;
  double max = 0;
  double min = distances.empty() ? 0.0 : distances.front();
  for (const double distance : distances) {
    sum += distance;
    squares += distance * distance;
    max = std::max(max, std::abs(distance));
    min = std::min(min, distance);
  }
  out.set_count(static_cast<std::uint32_t>(points.size()));
  if (points.empty()) return {};
  const auto count = static_cast<double>(points.size());
  out.set_mean_m(sum / count);
  out.set_rms_m(std::sqrt(squares / count));
  out.set_max_m(max);
  out.set_min_m(min);
  return {};
}

Result<std::vector<geometry::Vec3>> seen_vertices(const DualShape& shape) {
  std::vector<geometry::Vec3> vertices;
  if (!shape.fit) return vertices;
  const auto trim = shape.trim();
  if (!trim) return trim.error();
  const auto mesh = geometry::tessellate(shape.fit->surface, shape.fit->frame, *trim);
  if (!mesh) return mesh.error();
  constexpr double seen = 0.5;
  for (std::size_t i = 0; i < mesh->positions.size(); ++i) {
    if (mesh->opacity[i] >= seen) vertices.push_back(mesh->positions[i]);
  }
  return vertices;
}

}  // namespace

Result<v1::QueryResult> distance_to_reference(const v1::DistanceQuery& query, const Document& document) {
  const auto shape = require_dual(document, query.entity(), "distance.entity");
  if (!shape) return shape.error();
  const auto reference = require_reference(document, query.reference());
  if (!reference) return reference.error();
  const geometry::MeshDistance* const mesh = (*reference)->mesh->distance();
  if (mesh == nullptr) {
    return make_error(ErrorCode::failed_precondition, fmt::format("\"{}\" has no area", (*reference)->id),
                      "distance.reference");
  }
  std::vector<geometry::Vec3> points;
  points.reserve((*shape)->points.size());
  for (const DualPoint& point : (*shape)->points) points.push_back(point.position());
  const auto surface = seen_vertices(**shape);
  if (!surface) return surface.error();
  v1::QueryResult result;
  v1::DistanceResult& out = *result.mutable_distance();
  if (auto status = measure(*mesh, points, *out.mutable_points()); !status) return status.error();
  if (auto status = measure(*mesh, *surface, *out.mutable_surface()); !status) return status.error();
  return result;
}

}  // namespace handloft::model
