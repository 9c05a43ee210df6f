#include "server-model/geometry/trim_field.h"

namespace handloft::geometry {

const BoundaryTrim* TrimField::boundary() const {
  const auto* held = std::get_if<std::shared_ptr<const BoundaryTrim>>(&trim_);
  return held == nullptr ? nullptr : held->get();
}

double TrimField::opacity(const Vec2& xy) const {
  if (const BoundaryTrim* curve = boundary()) return curve->opacity(xy);
  return superellipse()->opacity(xy);
}

Box2 TrimField::solid_box() const {
  if (const BoundaryTrim* curve = boundary()) return curve->box();
  return {superellipse()->centre(), superellipse()->contour_half_extent(trim_level())};
}

Box2 TrimField::visible_box() const {
  if (const BoundaryTrim* curve = boundary()) return curve->visible_box();
  return {superellipse()->centre(), superellipse()->contour_half_extent(visible_level())};
}

Vec2 TrimField::core() const {
  if (const BoundaryTrim* curve = boundary()) return curve->deepest();
  return superellipse()->centre();
}

std::vector<Vec2> TrimField::outline(int per_quadrant) const {
  if (const BoundaryTrim* curve = boundary()) return curve->polygon();
  return superellipse()->contour(trim_level(), per_quadrant);
}

}  // namespace handloft::geometry
