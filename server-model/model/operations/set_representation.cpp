#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace {

const char* words_for(Representation representation) {
  switch (representation) {
    case Representation::points:
      return "points";
    case Representation::surface:
      return "a surface";
    case Representation::both:
      return "points and a surface";
  }
  return "";
}

}  // namespace

Result<Representation> read_representation(handloft::v1::Representation representation,
                                           std::string_view field) {
  switch (representation) {
    case handloft::v1::REPRESENTATION_POINTS:
      return Representation::points;
    case handloft::v1::REPRESENTATION_SURFACE:
      return Representation::surface;
    case handloft::v1::REPRESENTATION_BOTH:
      return Representation::both;
    default:
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found {}, expected POINTS, SURFACE or BOTH", static_cast<int>(representation)),
          std::string(field));
  }
}

void show(Document& document, std::string_view entity, Representation representation) {
  const DualPtr shape = document.find_dual(entity);
  if (!shape) return;
  for (const DualPtr& before : {shape, linked_partner(document, *shape)}) {
    if (!before || before->representation == representation) continue;
    if (representation == Representation::surface && !before->fitted()) continue;
    DualShape changed = *before;
    changed.representation = representation;
    put(document, std::move(changed));
  }
}

Result<Outcome> set_representation(const Document& document, const handloft::v1::SetRepresentation& request,
                                   const ApplyContext&) {
  auto found = require_dual(document, request.entity(), "set_representation.entity");
  if (!found) return found.error();
  const auto representation =
      read_representation(request.representation(), "set_representation.representation");
  if (!representation) return representation.error();
  if (*representation == Representation::surface && !(*found)->fitted()) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("\"{}\" is not fitted yet, so it would vanish", (*found)->id),
                      "set_representation.entity");
  }
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_set_representation() = request;
  outcome.words = fmt::format("Show \"{}\" as {}", (*found)->name, words_for(*representation));
  show(outcome.document, request.entity(), *representation);
  return outcome;
}

}  // namespace handloft::model
