// Trimming by a drawn curve (A24).
#include <fmt/format.h>

#include <memory>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {
namespace {

/// Null for no curve.
Result<std::shared_ptr<const TrimCurve>> read_curve(const handloft::v1::SetBoundary& request,
                                                    const Limits& limits) {
  if (static_cast<std::size_t>(request.curve_size()) > limits.max_boundary_points) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} places, expected at most {}", request.curve_size(), limits.max_boundary_points),
        "set_boundary.curve");
  }
  std::vector<geometry::Vec3> points;
  points.reserve(static_cast<std::size_t>(request.curve_size()));
  for (const handloft::v1::Vec3& point : request.curve()) {
    const std::string field = fmt::format("set_boundary.curve[{}]", points.size());
    for (const double value : {point.x(), point.y(), point.z()}) {
      if (Status status = check_coordinate(value, field, limits); !status.ok()) return status.error();
    }
    points.emplace_back(point.x(), point.y(), point.z());
  }
  if (points.empty()) return std::shared_ptr<const TrimCurve>();
  return std::make_shared<const TrimCurve>(std::move(points));
}

}  // namespace

Result<Outcome> set_boundary(const Document& document, const handloft::v1::SetBoundary& request,
                             const ApplyContext& context) {
  auto found = require_dual(document, request.entity(), "set_boundary.entity");
  if (!found) return found.error();
  const DualShape& shape = **found;
  auto curve = read_curve(request, context.limits);
  if (!curve) return curve.error();
  if (*curve) {
    if (!shape.fit) {
      return make_error(
          ErrorCode::failed_precondition,
          fmt::format("\"{}\" is not fitted yet, so there is no base plane to project on", shape.id),
          "set_boundary.entity");
    }
    if (auto trim = (*curve)->in(shape.fit->frame); !trim) {
      Error error = trim.error();
      error.field = "set_boundary." + error.field;
      return error;
    }
  }
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_set_boundary() = request;
  outcome.words =
      *curve ? fmt::format("Trim \"{}\" with a curve of {} places", shape.name, (*curve)->points().size())
             : fmt::format("Trim \"{}\" with the superellipse", shape.name);
  const DualPtr partner = linked_partner(document, shape);
  for (const DualPtr& before : {*found, partner}) {  // Edits are mirrored (A12).
    if (!before) continue;
    const auto after = before == partner ? mirrored(*curve, shape.plane) : *curve;
    if (before->boundary == after || (before->boundary && after && *before->boundary == *after)) continue;
    DualShape changed = *before;
    changed.boundary = after;
    put(outcome.document, std::move(changed));
  }
  return outcome;
}

}  // namespace handloft::model
