// A copy of a shape beside it, with an id of its own.

#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/transform.h"
#include "server-model/model/validate.h"

namespace handloft::model {

Result<Outcome> duplicate(const Document& document, const handloft::v1::Duplicate& request,
                          const ApplyContext& context) {
  auto found = require_dual(document, request.entity(), "duplicate.entity");
  if (!found) return found.error();
  if (!request.id().empty()) {
    if (auto status = check_id(request.id(), "duplicate.id", context.limits); !status) return status.error();
  }
  if (auto status = check_name(request.name(), "duplicate.name", context.limits); !status) {
    return status.error();
  }
  auto translation = read_vector(request.translation(), "duplicate.translation", context.limits);
  if (!translation) return translation.error();

  DualShape copy = **found;
  if (!translation->isZero(0)) {
    Similarity similarity;
    similarity.shift = *translation;
    auto beside = moved(copy, similarity, SymmetryPlane::goes_along, "duplicate.translation", context.limits);
    if (!beside) return beside.error();
    copy = std::move(*beside);
  }
  if (copy.symmetry == SymmetryMode::partner) {
    // The partner has one original only. The points' numbers of their images are never asked for again.
    copy.symmetry = SymmetryMode::off;
    copy.partner.clear();
    copy.plane = {};
    copy.linked_from = 0;
  }
  Outcome outcome;
  outcome.document = document;
  copy.id = request.id().empty() ? free_shape_id(document) : request.id();
  count_shape_id(outcome.document, copy.id);
  constexpr std::string_view suffix = " (copy)";
  if (!request.name().empty()) {
    copy.name = request.name();
  } else if (copy.name.size() + suffix.size() <= context.limits.max_name_bytes) {
    copy.name += suffix;
  }
  outcome.words = fmt::format("Duplicate \"{}\"", (*found)->name);
  auto& effective = *outcome.effective.mutable_duplicate();
  effective = request;
  effective.set_id(copy.id);
  if (auto status = add_entity(outcome.document, std::move(copy), "duplicate.id", context.limits); !status) {
    return status.error();
  }
  return outcome;
}

}  // namespace handloft::model
