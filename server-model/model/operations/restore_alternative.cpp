#include <fmt/format.h>

#include "server-model/model/operations/operations.h"

namespace handloft::model {

Result<Outcome> restore_alternative(const Document& document, const handloft::v1::RestoreAlternative& request,
                                    const ApplyContext&) {
  const auto from = require_alternative(document, request.name(), "restore_alternative.name");
  if (!from) return from.error();
  Outcome outcome;
  outcome.document = document;
  if (*from != document.present) outcome.document.entities = *(*document.alternatives)[*from].entities;
  const std::string& version = (*document.alternatives)[*from].version;
  if (version != (*document.alternatives)[document.present].version) {
    auto alternatives = std::make_shared<Alternatives>(*document.alternatives);
    (*alternatives)[document.present].version = version;
    outcome.document.alternatives = std::move(alternatives);
  }
  *outcome.effective.mutable_restore_alternative() = request;
  outcome.words =
      fmt::format("Restore alternative \"{}\" into \"{}\"", request.name(), document.present_alternative());
  return outcome;
}

}  // namespace handloft::model
