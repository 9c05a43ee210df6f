#include <fmt/format.h>

#include <algorithm>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace {

bool exists(const Document& document, std::string_view name) {
  return std::any_of(document.alternatives->begin(), document.alternatives->end(),
                     [&](const Alternative& each) { return each.name == name; });
}

std::string next_free_name(const Document& document) {
  for (std::size_t n = document.alternatives->size() + 1;; ++n) {
    std::string name = fmt::format("alternative {}", n);
    if (!exists(document, name)) return name;
  }
}

}  // namespace

Result<std::size_t> require_alternative(const Document& document, std::string_view name,
                                        std::string_view field) {
  for (std::size_t i = 0; i < document.alternatives->size(); ++i) {
    if ((*document.alternatives)[i].name == name) return i;
  }
  return make_error(ErrorCode::not_found, fmt::format("there is no alternative \"{}\"", name),
                    std::string(field));
}

Result<Outcome> new_alternative(const Document& document, const handloft::v1::NewAlternative& request,
                                const ApplyContext& context) {
  const std::string field = "new_alternative.name";
  if (auto status = check_name(request.name(), field, context.limits); !status) return status.error();
  const std::string name = request.name().empty() ? next_free_name(document) : request.name();
  if (exists(document, name)) {
    return make_error(ErrorCode::already_exists, fmt::format("there is an alternative \"{}\" already", name),
                      field);
  }
  if (document.alternatives->size() >= context.limits.max_alternatives) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("the document has {} alternatives, expected at most {}",
                                  document.alternatives->size(), context.limits.max_alternatives),
                      field);
  }
  VersionPtr version;
  if (!request.version().empty()) {
    auto found = require_version(document, request.version(), "new_alternative.version");
    if (!found) return found.error();
    version = *found;
  }
  Outcome outcome;
  outcome.document = document;
  auto alternatives = std::make_shared<Alternatives>(*document.alternatives);
  (*alternatives)[document.present].entities = std::make_shared<const Document::Entities>(document.entities);
  alternatives->push_back(
      {name, nullptr, version ? version->name : (*alternatives)[document.present].version});
  if (version) outcome.document.entities = *version->entities;
  outcome.document.present = alternatives->size() - 1;
  outcome.document.alternatives = std::move(alternatives);
  outcome.effective.mutable_new_alternative()->set_name(name);
  outcome.effective.mutable_new_alternative()->set_version(request.version());
  outcome.words = version
                      ? fmt::format("New alternative \"{}\" from version \"{}\"", name, version->name)
                      : fmt::format("New alternative \"{}\" of \"{}\"", name, document.present_alternative());
  return outcome;
}

}  // namespace handloft::model
