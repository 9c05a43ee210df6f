#include "server-model/session/resolve_model.h"

#include <chrono>
#include <string>
#include <utility>

#include "common/base/clock.h"
#include "server-model/exchange/cad_kernel.h"
#include "server-model/model/bspline_message.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

/// Longer than this nobody waits for triangles that are only looked at.
constexpr Duration max_tessellation = std::chrono::seconds(20);

exchange::CadImportOptions options_of(const v1::ImportModel& request, const Limits& limits) {
  exchange::CadImportOptions options;
  const v1::Vec3& by = request.translation();
  options.translation = {by.x(), by.y(), by.z()};
  options.max_model_bytes = limits.max_model_bytes;
  options.max_faces = limits.max_model_faces;
  options.max_control_points = limits.max_control_points;
  options.max_trim_curves = limits.max_trim_curves;
  options.max_coordinate_m = limits.max_coordinate_m;
  options.max_vertices = limits.max_reference_vertices;
  options.max_triangles = limits.max_reference_triangles;
  return options;
}

/// A file may name its faces as it likes; what people could not be shown goes without.
std::string usable_name(const std::string& name, const Limits& limits) {
  return check_name(name, "name", limits) && name != "NONE" ? name : std::string();  // STEP's "NONE" is none.
}

void write_face(const exchange::ImportedFace& from, const Limits& limits, v1::ResolvedModel::Face& to) {
  to.set_number(from.number);
  to.set_name(usable_name(from.face.name, limits));
  to.set_reversed(from.face.reversed);
  write_surface(from.face.surface, *to.mutable_surface());
  FaceTrim trim;
  for (const auto& loop : from.face.loops) {
    std::vector<TrimSpline>& curves = trim.emplace_back();
    for (const exchange::TrimCurve& curve : loop)
      curves.push_back({curve.knots, curve.control, curve.weights});
  }
  write_trim(trim, *to.mutable_loops());
}

}  // namespace

Result<v1::Operation> resolve_model(const v1::Operation& operation, const FileAccess& files,
                                    const Limits& limits) {
  const v1::ImportModel& request = operation.import_model();
  if (request.has_resolved()) {
    if (files.scope == FileAccess::Scope::anywhere && request.path().empty()) return operation;
    return make_error(ErrorCode::permission_denied,
                      "found a model that was read elsewhere, expected the path of a STEP or IGES file",
                      "import_model.resolved");
  }
  if (request.path().empty()) {
    return make_error(ErrorCode::invalid_argument,
                      "the path is missing, expected that of a STEP or IGES file", "import_model.path");
  }
  auto path = files.to_read(request.path(), "import_model.path");
  if (!path) return path.error();
  const auto imported = files.cad_kernel().import_model(*path, options_of(request, limits), max_tessellation);
  if (!imported) {
    Error error = imported.error();
    error.field = "import_model." + error.field;
    return error;
  }
  v1::Operation resolved = operation;
  v1::ImportModel& into = *resolved.mutable_import_model();
  if (into.name().empty()) into.set_name(usable_name(path->stem().string(), limits));
  into.clear_path();
  v1::ResolvedModel& model = *into.mutable_resolved();
  model.set_boundary_representation(imported->boundary_representation);
  model.set_metres_per_unit(imported->metres_per_unit);
  for (const exchange::ImportedFace& face : imported->faces) write_face(face, limits, *model.add_faces());
  for (const std::string& note : imported->notes) model.add_notes(note);
  if (!imported->rest_indices.empty()) {
    v1::TriangleMesh& rest = *model.mutable_rest();
    for (const geometry::Vec3& p : imported->rest_positions) {
      for (const double coordinate : p) rest.add_positions(static_cast<float>(coordinate));
    }
    rest.mutable_indices()->Add(imported->rest_indices.begin(), imported->rest_indices.end());
  }
  return resolved;
}

}  // namespace handloft::model
