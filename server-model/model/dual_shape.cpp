#include "server-model/model/dual_shape.h"

namespace handloft::model {

Result<geometry::Superellipse> DualShape::superellipse() const {
  if (!fit) {
    return make_error(ErrorCode::failed_precondition, "\"" + id + "\" is not fitted yet", "entity");
  }
  return geometry::Superellipse::create(fit->box, superellipse_exponent);
}

Result<geometry::TrimField> DualShape::trim() const {
  if (fit && boundary) {
    if (auto drawn = boundary->in(fit->frame)) return geometry::TrimField(*std::move(drawn));
  }
  auto about_the_footprint = superellipse();
  if (!about_the_footprint) return about_the_footprint.error();
  return geometry::TrimField(*about_the_footprint);
}

std::string_view to_string(SymmetryMode mode) {
  switch (mode) {
    case SymmetryMode::off:
      return "off";
    case SymmetryMode::same_shape:
      return "same_shape";
    case SymmetryMode::partner:
      return "partner";
  }
  return "off";
}

}  // namespace handloft::model
