#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

Result<Outcome> delete_entity(const Document& document, const handloft::v1::Delete& request,
                              const ApplyContext&) {
  auto found = require_entity(document, request.entity(), "delete.entity");
  if (!found) return found.error();
  Outcome outcome;
  outcome.document = document;
  if (const DualPtr dual = as_dual(*found)) {
    DualShape shape = *dual;
    release_symmetry(outcome.document, shape);  // The partner stays, on its own.
  }
  outcome.document.entities.erase((*found)->id);
  *outcome.effective.mutable_delete_() = request;
  outcome.words = fmt::format("Delete \"{}\"", (*found)->name);
  return outcome;
}

}  // namespace handloft::model
