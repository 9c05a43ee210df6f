#include <fmt/format.h>

#include "server-model/model/operations/operations.h"

namespace handloft::model {

Result<Outcome> delete_alternative(const Document& document, const handloft::v1::DeleteAlternative& request,
                                   const ApplyContext&) {
  const auto which = require_alternative(document, request.name(), "delete_alternative.name");
  if (!which) return which.error();
  if (*which == document.present) {
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("\"{}\" is the present alternative; switch to another one first", request.name()),
        "delete_alternative.name");
  }
  Outcome outcome;
  outcome.document = document;
  auto alternatives = std::make_shared<Alternatives>(*document.alternatives);
  alternatives->erase(alternatives->begin() + static_cast<std::ptrdiff_t>(*which));
  outcome.document.alternatives = std::move(alternatives);
  if (*which < document.present) --outcome.document.present;
  *outcome.effective.mutable_delete_alternative() = request;
  outcome.words = fmt::format("Delete alternative \"{}\"", request.name());
  return outcome;
}

}  // namespace handloft::model
