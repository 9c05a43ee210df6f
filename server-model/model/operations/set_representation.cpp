#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

Result<Outcome> set_representation(const Document& document, const handloft::v1::SetRepresentation& request,
                                   const ApplyContext&) {
  auto found = require_entity(document, request.entity(), "set_representation.entity");
  if (!found) return found.error();
  Representation representation = Representation::points;
  const char* words = "points";
  switch (request.representation()) {
    case handloft::v1::REPRESENTATION_POINTS:
      break;
    case handloft::v1::REPRESENTATION_SURFACE:
      representation = Representation::surface;
      words = "a surface";
      break;
    case handloft::v1::REPRESENTATION_BOTH:
      representation = Representation::both;
      words = "points and a surface";
      break;
    default:
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected POINTS, SURFACE or BOTH",
                                    static_cast<int>(request.representation())),
                        "set_representation.representation");
  }
  if (representation == Representation::surface && !(*found)->fitted()) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("\"{}\" is not fitted yet, so it would vanish", (*found)->id),
                      "set_representation.entity");
  }
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_set_representation() = request;
  outcome.words = fmt::format("Show \"{}\" as {}", (*found)->name, words);
  for (const EntityPtr& before : {*found, linked_partner(document, **found)}) {  // Edits are mirrored (A12).
    if (!before || before->representation == representation) continue;
    if (representation == Representation::surface && !before->fitted()) continue;
    DualShape shape = *before;
    shape.representation = representation;
    put(outcome.document, std::move(shape));
  }
  return outcome;
}

}  // namespace handloft::model
