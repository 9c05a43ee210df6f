#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

Result<Outcome> set_superellipse(const Document& document, const handloft::v1::SetSuperellipse& request,
                                 const ApplyContext& context) {
  auto found = require_dual(document, request.entity(), "set_superellipse.entity");
  if (!found) return found.error();
  const double exponent = request.exponent();
  const Limits& limits = context.limits;
  if (!(exponent >= limits.min_superellipse_exponent && exponent <= limits.max_superellipse_exponent)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected {}..{}", exponent, limits.min_superellipse_exponent,
                                  limits.max_superellipse_exponent),
                      "set_superellipse.exponent");
  }
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_set_superellipse() = request;
  outcome.words = fmt::format("Trim \"{}\" with the exponent {:.3g}", (*found)->name, exponent);
  for (const DualPtr& before : {*found, linked_partner(document, **found)}) {  // Edits are mirrored (A12).
    if (!before || (before->superellipse_exponent == exponent && !before->boundary)) continue;
    DualShape shape = *before;
    shape.superellipse_exponent = exponent;
    shape.boundary = nullptr;
    put(outcome.document, std::move(shape));
  }
  return outcome;
}

}  // namespace handloft::model
