// Named versions (U6): a design as it was, under a name; restored, branched from (new_alternative.cpp) and
// forgotten.

#include <fmt/format.h>

#include <utility>

#include "server-model/model/canonical.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

/// Whose version the present alternative is at from now on.
void set_present_version(Document& document, const std::string& version) {
  if ((*document.alternatives)[document.present].version == version) return;
  auto alternatives = std::make_shared<Alternatives>(*document.alternatives);
  (*alternatives)[document.present].version = version;
  document.alternatives = std::move(alternatives);
}

}  // namespace

Result<VersionPtr> require_version(const Document& document, std::string_view name, std::string_view field) {
  const auto found = document.versions->find(name);
  if (found != document.versions->end()) return found->second;
  const bool printable = check_name(name, {}, Limits{}).ok();
  return make_error(
      ErrorCode::not_found,
      printable ? fmt::format("there is no version \"{}\"", name) : std::string("there is no such version"),
      std::string(field));
}

Result<Outcome> name_version(const Document& document, const v1::Operation& operation,
                             const ApplyContext& context) {
  const v1::NameVersion& request = operation.name_version();
  const std::string& name = request.name();
  if (name.empty() || name.size() > context.limits.max_version_name_bytes) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found a name of {} bytes, expected 1..{}", name.size(),
                                  context.limits.max_version_name_bytes),
                      "name_version.name");
  }
  if (auto status = check_name(name, "name_version.name", context.limits); !status) return status.error();
  if (auto status = check_text(request.note(), context.limits.max_note_bytes, "name_version.note"); !status)
    return status.error();
  if (document.versions->contains(name)) {
    return make_error(ErrorCode::already_exists, fmt::format("there is a version \"{}\" already", name),
                      "name_version.name");
  }
  if (document.versions->size() >= context.limits.max_versions) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("the document has {} versions, expected at most {}",
                                  document.versions->size(), context.limits.max_versions),
                      "name_version.name");
  }
  auto version = std::make_shared<Version>();
  version->name = name;
  version->note = request.note();
  version->author = operation.author();
  version->made_ns = operation.made_ns();
  version->alternative = document.present_alternative();
  version->sequence = context.sequence;
  version->parent = (*document.alternatives)[document.present].version;
  version->entities = std::make_shared<const Entities>(document.entities);
  version->digest = EntityDigests().of(document.entities);
  Outcome outcome;
  outcome.document = document;
  auto versions = std::make_shared<Versions>(*document.versions);
  versions->insert_or_assign(name, std::move(version));
  outcome.document.versions = std::move(versions);
  set_present_version(outcome.document, name);
  *outcome.effective.mutable_name_version() = request;
  outcome.words = fmt::format("Name version \"{}\" of \"{}\"", name, document.present_alternative());
  return outcome;
}

Result<Outcome> restore_version(const Document& document, const v1::RestoreVersion& request,
                                const ApplyContext&) {
  auto version = require_version(document, request.name(), "restore_version.name");
  if (!version) return version.error();
  Outcome outcome;
  outcome.document = document;
  if (document.entities != *(*version)->entities) outcome.document.entities = *(*version)->entities;
  set_present_version(outcome.document, request.name());
  *outcome.effective.mutable_restore_version() = request;
  outcome.words =
      fmt::format("Restore version \"{}\" into \"{}\"", request.name(), document.present_alternative());
  return outcome;
}

// What came after it is now after the one before it.
Result<Outcome> delete_version(const Document& document, const v1::DeleteVersion& request,
                               const ApplyContext&) {
  auto version = require_version(document, request.name(), "delete_version.name");
  if (!version) return version.error();
  const std::string& name = request.name();
  const std::string& parent = (*version)->parent;
  Outcome outcome;
  outcome.document = document;
  auto versions = std::make_shared<Versions>(*document.versions);
  versions->erase(name);
  for (auto& [other, child] : *versions) {
    if (child->parent != name) continue;
    auto moved = std::make_shared<Version>(*child);
    moved->parent = parent;
    child = std::move(moved);
  }
  outcome.document.versions = std::move(versions);
  auto alternatives = std::make_shared<Alternatives>(*document.alternatives);
  bool changed = false;
  for (Alternative& alternative : *alternatives) {
    if (alternative.version != name) continue;
    alternative.version = parent;
    changed = true;
  }
  if (changed) outcome.document.alternatives = std::move(alternatives);
  *outcome.effective.mutable_delete_version() = request;
  outcome.words = fmt::format("Delete version \"{}\"", name);
  return outcome;
}

}  // namespace handloft::model
