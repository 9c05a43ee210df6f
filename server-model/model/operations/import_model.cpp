// A CAD model (issue of D19: "commit to the CAD database" and from it): its sculptable faces as entities of
// their own, all else kept.

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server-model/model/bspline_message.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/sculpting.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

/// Shown to a person who waits for the answer; what reads files makes half as many.
constexpr int max_notes = 64;

}  // namespace

Result<Outcome> import_model(const Document& document, const v1::ImportModel& request,
                             const ApplyContext& context) {
  const Limits& limits = context.limits;
  if (!request.has_resolved()) {
    return make_error(ErrorCode::failed_precondition, "the model has not been read from its file",
                      "import_model.resolved");
  }
  if (!request.path().empty()) {
    return make_error(ErrorCode::invalid_argument, "found a path beside a model that was read",
                      "import_model.resolved");
  }
  const v1::ResolvedModel& resolved = request.resolved();
  CadModel model;
  model.id = request.id().empty() ? free_id(document, "model") : request.id();
  if (auto status = check_id(model.id, "import_model.id", limits); !status) return status.error();
  if (auto status = check_name(request.name(), "import_model.name", limits); !status) return status.error();
  model.name = request.name().empty() ? model.id : request.name();
  auto translation = read_vector(request.translation(), "import_model.translation", limits);
  if (!translation) return translation.error();
  model.translation = *translation;
  constexpr double min_unit_m = 1e-9, max_unit_m = 1e6;
  if (!(resolved.metres_per_unit() >= min_unit_m && resolved.metres_per_unit() <= max_unit_m)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected {}..{}", resolved.metres_per_unit(), min_unit_m, max_unit_m),
        "import_model.resolved.metres_per_unit");
  }
  model.metres_per_unit = resolved.metres_per_unit();
  if (resolved.boundary_representation().size() > limits.max_model_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, expected at most {}",
                                  resolved.boundary_representation().size(), limits.max_model_bytes),
                      "import_model.resolved.boundary_representation");
  }
  if (static_cast<std::size_t>(resolved.faces_size()) > limits.max_model_faces) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} faces, expected at most {}", resolved.faces_size(), limits.max_model_faces),
        "import_model.resolved.faces");
  }
  model.boundary_representation = std::make_shared<const std::string>(resolved.boundary_representation());
  if (resolved.has_rest()) {
    auto rest = read_mesh(resolved.rest(), "import_model.resolved.rest", limits);
    if (!rest) return rest.error();
    model.rest = std::move(*rest);
  }
  Outcome outcome;
  outcome.document = document;
  outcome.notes.assign(resolved.notes().begin(),
                       resolved.notes().begin() + std::min(resolved.notes_size(), max_notes));
  for (int i = 0; i < resolved.faces_size(); ++i) {
    const v1::ResolvedModel::Face& face = resolved.faces(i);
    const std::string field = fmt::format("import_model.resolved.faces[{}]", i);
    auto surface = read_surface(face.surface(), field + ".surface", limits);
    if (!surface) return surface.error();
    auto trim = read_trim(face.loops(), field + ".loops", limits);
    if (!trim) return trim.error();
    if (auto status = check_name(face.name(), field + ".name", limits); !status) return status.error();
    SculptShape shape;
    shape.id = fmt::format("{}.face-{}", model.id, face.number());
    shape.name = face.name().empty() ? shape.id : face.name();
    shape.model = model.id;
    shape.face = face.number();
    shape.reversed = face.reversed();
    set_at_rest(shape, std::move(*surface), std::move(*trim));
    model.faces.push_back(shape.id);
    if (auto status = add_entity(outcome.document, std::make_shared<const SculptShape>(std::move(shape)),
                                 field + ".number", limits);
        !status) {
      return status.error();
    }
  }
  outcome.words = fmt::format("Import model \"{}\" with {} face{} to sculpt", model.name, model.faces.size(),
                              model.faces.size() == 1 ? "" : "s");
  *outcome.effective.mutable_import_model() = request;
  outcome.effective.mutable_import_model()->set_id(model.id);
  if (auto status = add_entity(outcome.document, std::make_shared<const CadModel>(std::move(model)),
                               "import_model.id", limits);
      !status) {
    return status.error();
  }
  return outcome;
}

}  // namespace handloft::model
