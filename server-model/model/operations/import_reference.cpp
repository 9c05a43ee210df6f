#include <fmt/format.h>

#include <cmath>

#include "server-model/model/operations/operations.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/validate.h"

namespace handloft::model {

Result<std::shared_ptr<const ReferenceMesh>> read_mesh(const handloft::v1::TriangleMesh& from,
                                                       const std::string& field, const Limits& limits) {
  const auto vertices = static_cast<std::size_t>(from.positions_size()) / 3;
  const auto triangles = static_cast<std::size_t>(from.indices_size()) / 3;
  if (from.positions_size() % 3 != 0 || from.indices_size() % 3 != 0 || triangles == 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} coordinates and {} indices, expected three a vertex and three a "
                                  "triangle",
                                  from.positions_size(), from.indices_size()),
                      field);
  }
  if (vertices > limits.max_reference_vertices || triangles > limits.max_reference_triangles) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} vertices and {} triangles, expected at most {} and {}", vertices,
                                  triangles, limits.max_reference_vertices, limits.max_reference_triangles),
                      field);
  }
  auto mesh = std::make_shared<ReferenceMesh>();
  mesh->positions.resize(vertices);
  for (std::size_t i = 0; i < 3 * vertices; ++i) {
    const float value = from.positions(static_cast<int>(i));
    // The path is only spelled out for a bad one.
    if (!(std::abs(value) <= limits.max_coordinate_m)) {
      return check_coordinate(static_cast<double>(value), fmt::format("{}.positions[{}]", field, i), limits)
          .error();
    }
    mesh->positions[i / 3][i % 3] = value;
  }
  mesh->triangles.resize(triangles);
  for (std::size_t i = 0; i < 3 * triangles; ++i) {
    const std::uint32_t index = from.indices(static_cast<int>(i));
    if (index >= vertices) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected below {}", index, vertices),
                        fmt::format("{}.indices[{}]", field, i));
    }
    mesh->triangles[i / 3][i % 3] = index;
  }
  if (!mesh->has_area()) {
    return make_error(ErrorCode::invalid_argument, "found no triangle with an area", field + ".indices");
  }
  return std::shared_ptr<const ReferenceMesh>(std::move(mesh));
}

Result<Outcome> import_reference(const Document& document, const handloft::v1::ImportReference& request,
                                 const ApplyContext& context) {
  if (!request.has_resolved()) {
    return make_error(ErrorCode::failed_precondition, "the mesh has not been read from its file",
                      "import_reference.resolved");
  }
  if (!request.path().empty() || request.scale() != 0 || request.y_up() || request.has_translation()) {
    return make_error(ErrorCode::invalid_argument,
                      "found a path or a placement beside a mesh, which stands in the world already",
                      "import_reference.resolved");
  }
  const std::string id = request.id().empty() ? free_id(document, "reference") : request.id();
  if (auto status = check_id(id, "import_reference.id", context.limits); !status) return status.error();
  if (auto status = check_name(request.name(), "import_reference.name", context.limits); !status) {
    return status.error();
  }
  auto mesh = read_mesh(request.resolved(), "import_reference.resolved", context.limits);
  if (!mesh) return mesh.error();
  auto reference = std::make_shared<ReferenceShape>();
  reference->id = id;
  reference->name = request.name().empty() ? id : request.name();
  reference->mesh = std::move(*mesh);

  Outcome outcome;
  outcome.document = document;
  if (auto status = add_entity(outcome.document, reference, "import_reference.id", context.limits); !status) {
    return status.error();
  }
  *outcome.effective.mutable_import_reference() = request;
  outcome.effective.mutable_import_reference()->set_id(id);
  const std::size_t triangles = reference->mesh->triangles.size();
  outcome.words = fmt::format("Import reference \"{}\" of {} triangle{}", reference->name, triangles,
                              triangles == 1 ? "" : "s");
  return outcome;
}

}  // namespace handloft::model
