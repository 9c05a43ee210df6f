// A copy of a shape beside it, with an id of its own.

#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/sculpting.h"
#include "server-model/model/operations/transform.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace {

std::string name_of_copy(const std::string& asked, const std::string& original, const Limits& limits) {
  constexpr std::string_view suffix = " (copy)";
  if (!asked.empty()) return asked;
  if (original.size() + suffix.size() > limits.max_name_bytes) return original;
  return original + std::string(suffix);
}

/// The copy of a model's face is a surface of its own.
Result<Outcome> duplicate_surface(const Document& document, const SculptShape& original,
                                  const handloft::v1::Duplicate& request, const geometry::Vec3& translation,
                                  const ApplyContext& context) {
  Similarity similarity;
  similarity.shift = translation;
  auto copy = moved(original, similarity, "duplicate.translation", context.limits);
  if (!copy) return copy.error();
  copy->id = request.id().empty() ? free_id(document, "surface") : request.id();
  copy->name = name_of_copy(request.name(), original.name, context.limits);
  copy->model.clear();
  copy->face = 0;
  Outcome outcome;
  outcome.document = document;
  outcome.words = fmt::format("Duplicate \"{}\"", original.name);
  *outcome.effective.mutable_duplicate() = request;
  outcome.effective.mutable_duplicate()->set_id(copy->id);
  if (auto status = add_entity(outcome.document, std::make_shared<const SculptShape>(std::move(*copy)),
                               "duplicate.id", context.limits);
      !status) {
    return status.error();
  }
  return outcome;
}

}  // namespace

Result<Outcome> duplicate(const Document& document, const handloft::v1::Duplicate& request,
                          const ApplyContext& context) {
  auto entity = require_entity(document, request.entity(), "duplicate.entity");
  if (!entity) return entity.error();
  if (!request.id().empty()) {
    if (auto status = check_id(request.id(), "duplicate.id", context.limits); !status) return status.error();
  }
  if (auto status = check_name(request.name(), "duplicate.name", context.limits); !status) {
    return status.error();
  }
  auto translation = read_vector(request.translation(), "duplicate.translation", context.limits);
  if (!translation) return translation.error();
  if (const SculptPtr surface = as_sculpt(*entity)) {
    return duplicate_surface(document, *surface, request, *translation, context);
  }
  if (!as_dual(*entity)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found \"{}\", a {}, expected a dual_shape or sculpt_surface: what is "
                                  "imported is not copied, import it again",
                                  request.entity(), to_string((*entity)->kind())),
                      "duplicate.entity");
  }
  auto found = require_dual(document, request.entity(), "duplicate.entity");
  if (!found) return found.error();

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
  copy.name = name_of_copy(request.name(), copy.name, context.limits);
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
