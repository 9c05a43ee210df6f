#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

void put(Document& document, DualShape shape) {
  std::string id = shape.id;
  document.entities.insert_or_assign(std::move(id), std::make_shared<const DualShape>(std::move(shape)));
}

Status add_entity(Document& document, DualShape shape, std::string_view field, const Limits& limits) {
  return add_entity(document, std::make_shared<const DualShape>(std::move(shape)), field, limits);
}

Status add_entity(Document& document, EntityPtr entity, std::string_view field, const Limits& limits) {
  const std::string& id = entity->id;
  if (document.used_ids->contains(id)) {
    return make_error(
        ErrorCode::already_exists,
        fmt::format(
            "the id \"{}\" {}", id,
            document.find(id) ? "is taken" : "belonged to a deleted entity; ids are never used again"),
        std::string(field));
  }
  if (document.entities.size() >= limits.max_entities || document.used_ids->size() >= limits.max_used_ids) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("the document holds {} entities and {} used ids, expected at most {} and {}",
                    document.entities.size(), document.used_ids->size(), limits.max_entities,
                    limits.max_used_ids),
        std::string(field));
  }
  auto ids = std::make_shared<Document::Ids>(*document.used_ids);
  ids->insert(id);
  document.used_ids = std::move(ids);
  document.entities.insert_or_assign(id, std::move(entity));
  return {};
}

namespace {

// The N of "shape-N"; nullopt for other ids and for numbers that are not worth counting on from.
std::optional<std::uint64_t> shape_number(std::string_view id) {
  constexpr std::string_view stem = "shape-";
  constexpr std::size_t max_digits = 9;
  if (!id.starts_with(stem) || id.size() > stem.size() + max_digits) return std::nullopt;
  std::uint64_t number = 0;
  const char* const end = id.data() + id.size();
  const auto [stop, error] = std::from_chars(id.data() + stem.size(), end, number);
  return error == std::errc() && stop == end ? std::optional(number) : std::nullopt;
}

}  // namespace

std::string free_id(const Document& document, std::string_view prefix) {
  for (std::uint64_t n = 1;; ++n) {
    std::string id = fmt::format("{}-{}", prefix, n);
    if (!document.used_ids->contains(id)) return id;
  }
}

std::string free_shape_id(const Document& document) {
  // used_ids is bounded, so this ends.
  for (std::uint64_t n = document.next_shape;; ++n) {
    std::string id = fmt::format("shape-{}", n);
    if (!document.used_ids->contains(id)) return id;
  }
}

void count_shape_id(Document& document, std::string_view id) {
  if (const auto number = shape_number(id)) document.next_shape = std::max(document.next_shape, *number + 1);
}

Result<Outcome> create_dual_shape(const Document& document, const handloft::v1::CreateDualShape& request,
                                  const ApplyContext& context) {
  if (auto status = check_degree(request.degree(), "create_dual_shape.degree", context.limits); !status) {
    return status.error();
  }
  if (auto status = check_name(request.name(), "create_dual_shape.name", context.limits); !status) {
    return status.error();
  }
  Outcome outcome;
  outcome.document = document;
  DualShape shape;
  shape.id = request.id();
  if (shape.id.empty()) {
    shape.id = free_shape_id(document);
  } else if (auto status = check_id(shape.id, "create_dual_shape.id", context.limits); !status) {
    return status.error();
  }
  count_shape_id(outcome.document, shape.id);
  shape.name = request.name().empty() ? shape.id : request.name();
  shape.requested_degree = request.degree() == 0 ? context.limits.default_degree : request.degree();

  outcome.words = fmt::format("Create \"{}\"", shape.name);
  auto& effective = *outcome.effective.mutable_create_dual_shape();
  effective = request;
  effective.set_id(shape.id);
  effective.set_degree(shape.requested_degree);
  if (auto status = add_entity(outcome.document, std::move(shape), "create_dual_shape.id", context.limits);
      !status) {
    return status.error();
  }
  return outcome;
}

}  // namespace handloft::model
