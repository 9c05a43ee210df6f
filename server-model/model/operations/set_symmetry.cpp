#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

void release_symmetry(Document& document, DualShape& shape) {
  if (const DualPtr linked = linked_partner(document, shape)) {
    DualShape partner = *linked;
    partner.symmetry = SymmetryMode::off;
    partner.partner.clear();
    partner.plane = {};
    partner.linked_from = 0;
    put(document, std::move(partner));
  }
  shape.symmetry = SymmetryMode::off;
  shape.partner.clear();
  shape.plane = {};
  shape.linked_from = 0;
}

Result<Outcome> set_symmetry(const Document& document, const handloft::v1::SetSymmetry& request,
                             const ApplyContext& context) {
  auto found = require_dual(document, request.entity(), "set_symmetry.entity");
  if (!found) return found.error();
  DualShape shape = **found;
  SymmetryMode mode = SymmetryMode::off;
  switch (request.mode()) {
    case handloft::v1::SetSymmetry::OFF:
      mode = SymmetryMode::off;
      break;
    case handloft::v1::SetSymmetry::SAME_SHAPE:
      mode = SymmetryMode::same_shape;
      break;
    case handloft::v1::SetSymmetry::PARTNER:
      mode = SymmetryMode::partner;
      break;
    default:
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found {}, expected OFF, SAME_SHAPE or PARTNER", static_cast<int>(request.mode())),
          "set_symmetry.mode");
  }
  geometry::Plane plane;
  if (mode != SymmetryMode::off) {
    auto read = read_plane(request.plane(), "set_symmetry.plane", context.limits);
    if (!read) return read.error();
    plane = *read;
  }
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_set_symmetry() = request;
  outcome.words = mode == SymmetryMode::off ? fmt::format("End the symmetry of \"{}\"", shape.name)
                                            : fmt::format("Mirror \"{}\"", shape.name);
  const bool same =
      shape.symmetry == mode && (mode == SymmetryMode::off ||
                                 (shape.plane.origin == plane.origin && shape.plane.normal == plane.normal));
  if (same) return outcome;
  release_symmetry(outcome.document, shape);
  shape.symmetry = mode;
  if (mode != SymmetryMode::off) {
    shape.plane = plane;
    shape.linked_from = static_cast<std::uint32_t>(shape.points.size());
  }
  put(outcome.document, std::move(shape));
  return outcome;
}

}  // namespace handloft::model
