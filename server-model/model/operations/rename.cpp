#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

Result<Outcome> rename(const Document& document, const handloft::v1::Rename& request,
                       const ApplyContext& context) {
  auto found = require_entity(document, request.entity(), "rename.entity");
  if (!found) return found.error();
  if (auto status = check_name(request.name(), "rename.name", context.limits); !status) return status.error();
  if (request.name().empty()) {
    return make_error(ErrorCode::invalid_argument, "found an empty name, expected one", "rename.name");
  }
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_rename() = request;
  outcome.words = fmt::format("Rename \"{}\" to \"{}\"", (*found)->name, request.name());
  if ((*found)->name != request.name()) {
    const std::shared_ptr<Entity> renamed = (*found)->clone();
    renamed->name = request.name();
    outcome.document.entities.insert_or_assign(renamed->id, renamed);
  }
  return outcome;
}

}  // namespace handloft::model
