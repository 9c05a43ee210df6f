#include <fmt/format.h>

#include "server-model/model/operations/operations.h"

namespace handloft::model {

Result<Outcome> switch_alternative(const Document& document, const handloft::v1::SwitchAlternative& request,
                                   const ApplyContext&) {
  const auto to = require_alternative(document, request.name(), "switch_alternative.name");
  if (!to) return to.error();
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_switch_alternative() = request;
  outcome.words = fmt::format("Switch to alternative \"{}\"", request.name());
  if (*to == document.present) return outcome;
  auto alternatives = std::make_shared<Alternatives>(*document.alternatives);
  (*alternatives)[document.present].entities = std::make_shared<const Document::Entities>(document.entities);
  outcome.document.entities = *(*alternatives)[*to].entities;
  (*alternatives)[*to].entities = nullptr;
  outcome.document.present = *to;
  outcome.document.alternatives = std::move(alternatives);
  return outcome;
}

}  // namespace handloft::model
