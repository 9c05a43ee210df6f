#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

Result<Outcome> import_strokes(const Document& document, const handloft::v1::ImportStrokes& request,
                               const ApplyContext& context) {
  auto found = require_dual(document, request.entity(), "import_strokes.entity");
  if (!found) return found.error();
  if (request.resolved().empty()) {
    return make_error(ErrorCode::failed_precondition, "the strokes have not been read from their file",
                      "import_strokes.resolved");
  }
  Outcome outcome;
  outcome.document = document;
  std::size_t count = 0;
  for (int i = 0; i < request.resolved_size(); ++i) {
    const std::string field = fmt::format("import_strokes.resolved[{}]", i);
    auto points = read_points(request.resolved(i).points(), field + ".points", context.limits);
    if (!points) return points.error();
    count += points->size();
    if (count > context.limits.max_points_per_operation) {
      return make_error(
          ErrorCode::resource_exhausted,
          fmt::format("found more than {} points in all", context.limits.max_points_per_operation), field);
    }
    const std::uint32_t stroke = outcome.document.find_dual(request.entity())->stroke_count + 1;
    auto extended = extend_stroke(outcome.document, request.entity(), stroke, *points, 0.0, context.limits);
    if (!extended) {
      Error error = extended.error();
      error.field = field + "." + error.field;
      return error;
    }
    outcome.document = std::move(*extended);
  }
  *outcome.effective.mutable_import_strokes() = request;
  outcome.words = fmt::format("Import {} stroke{} into \"{}\"", request.resolved_size(),
                              request.resolved_size() == 1 ? "" : "s", (*found)->name);
  return outcome;
}

}  // namespace handloft::model
