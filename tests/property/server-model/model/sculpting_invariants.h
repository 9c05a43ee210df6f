#pragma once
// What holds of every sculpted surface, whatever was done to it: numbers are numbers, the surface has the
// knots and the held sides of the one at rest, what acts is met, what does not act changes nothing (D6 -
// D14).

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

#include "server-model/geometry/region_border.h"
#include "server-model/geometry/sculpt_energy.h"
#include "server-model/geometry/sculpt_rows.h"
#include "server-model/model/model.h"
#include "server-model/model/sculpt_border.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model::test {

/// Largest coordinate: what rounding is measured by.
inline double size_of(const geometry::BSplineSurface& surface) {
  double size = 0;
  for (const geometry::Vec3& point : surface.control) size = std::max(size, point.cwiseAbs().maxCoeff());
  return size;
}

inline std::array<int, 2> orders_of(IconProperty property) {
  switch (property) {
    case IconProperty::tangent_u:
      return {1, 0};
    case IconProperty::tangent_v:
      return {0, 1};
    case IconProperty::second_u:
      return {2, 0};
    case IconProperty::second_v:
      return {0, 2};
    case IconProperty::twist:
      return {1, 1};
    default:
      return {0, 0};
  }
}

/// D14: the middle of a region; of a curve, half way along it in the parameter plane.
inline geometry::Vec2 shown_at(const SculptIcon& icon) {
  if (icon.shape == IconShape::point) return icon.parameters.front();
  if (icon.shape == IconShape::region) return 0.5 * (icon.parameters[0] + icon.parameters[1]);
  double length = 0;
  for (std::size_t i = 1; i < icon.parameters.size(); ++i)
    length += (icon.parameters[i] - icon.parameters[i - 1]).norm();
  double passed = 0;
  for (std::size_t i = 1; i < icon.parameters.size(); ++i) {
    const geometry::Vec2 way = icon.parameters[i] - icon.parameters[i - 1];
    if (way.norm() > 0 && passed + way.norm() >= length / 2)
      return icon.parameters[i - 1] + (length / 2 - passed) / way.norm() * way;
    passed += way.norm();
  }
  return icon.parameters.back();
}

/// How nearly constraints are met, of the size.
inline constexpr double met_within = 1e-10;

/// D11: with springs a region gives way, at places it may lack a few (D9).
inline std::string broken_region(const SculptIcon& icon, const SculptShape& shape, double allowed) {
  using geometry::Vec3;
  const geometry::UvRectangle region = region_of(icon);
  const geometry::BSplineSurface& surface = *shape.surface;
  if (icon.outside) {
    const auto held = geometry::points_outside(*shape.rest, region);
    if (!held) return "a region of no outside";
    for (const std::uint32_t i : *held) {
      if (surface.control[i] != shape.rest->control[i]) return "a point outside of its region that moved";
    }
    return "";
  }
  if (region_hold(icon, *shape.rest) == RegionHold::spring) return "";
  const bool by_points = region_hold(icon, *shape.rest) == RegionHold::points;
  const auto moved = [&](const Vec3& p) {
    return Vec3(icon.pivot + icon.rotation * (p - icon.pivot) + icon.translation);
  };
  std::vector<Vec3> now;
  if (by_points) {
    const auto points = geometry::points_over(*shape.rest, region);
    if (!points) return "a region of no control points";
    for (const std::uint32_t point : *points) now.push_back(surface.control[point]);
  } else {
    const auto places = geometry::region_places(*shape.rest, region);
    if (!places) return "a region of no places";
    for (const auto& place : *places) now.push_back(surface.evaluate(place.uv.x(), place.uv.y()));
  }
  if (now.size() != icon.reference->size()) return "a region of other control points";
  constexpr double part_at_places = 1e-4;
  const double off_allowed = by_points ? allowed : part_at_places * size_of(surface);
  for (std::size_t i = 0; i < now.size(); ++i) {
    const double off = (now[i] - moved((*icon.reference)[i])).norm();
    if (!(off <= off_allowed)) return fmt::format("a region that is off by {} m", off);
  }
  return "";
}

/// D6 - D8, D11: what an acting constraint demands, met.
inline std::string broken_constraint(const SculptIcon& icon, const SculptShape& shape, double size) {
  using geometry::Vec3;
  const double allowed = met_within * size;
  if (!icon.acts() || icon.role != IconRole::constraint || icon.shape == IconShape::curve) return "";
  const geometry::BSplineSurface& surface = *shape.surface;
  const auto moved = [&](const Vec3& p) {
    return Vec3(icon.pivot + icon.rotation * (p - icon.pivot) + icon.translation);
  };
  if (icon.shape == IconShape::region) return broken_region(icon, shape, allowed);
  const geometry::Vec2& uv = icon.parameters.front();
  if (icon.property == IconProperty::normal) {
    const Vec3 normal = icon.rotation * icon.reference->front();
    const geometry::SurfaceDerivatives at = surface.derivatives(uv.x(), uv.y(), 1);
    const double off = std::max(std::abs(normal.dot(at.su)), std::abs(normal.dot(at.sv)));
    // Tangents are differences of neighbours: of coordinates, a span apart.
    const double span =
        std::min(surface.u.length(), surface.v.length()) / static_cast<double>(surface.control.size());
    if (!(off <= allowed / span)) return fmt::format("a normal that is off by {}", off);
    return "";
  }
  const auto [a, b] = orders_of(icon.property);
  const auto functional = geometry::surface_functional(surface, uv.x(), uv.y(), a, b);
  Vec3 value = Vec3::Zero();
  double weight = 0;
  for (std::size_t k = 0; k < functional->point.size(); ++k) {
    value += functional->value[k] * surface.control[functional->point[k]];
    weight += std::abs(functional->value[k]);
  }
  constexpr double arrow_m = 0.05;
  const Vec3 target =
      a + b == 0
          ? moved(icon.reference->front())
          : Vec3(icon.rotation * icon.reference->front() + icon.translation / std::pow(arrow_m, a + b));
  const double off = (value - target).norm();
  if (!(off <= allowed * weight))
    return fmt::format("a {} constraint that is off by {}, of {}", to_string(icon.property), off, weight);
  return "";
}

inline std::string broken_icon(const SculptIcon& icon, const SculptShape& shape, double size) {
  if (!icon.reference || icon.parameters.empty()) return "a record without what it holds";
  for (const geometry::Vec2& uv : icon.parameters) {
    if (!uv.allFinite()) return "parameters of no numbers";
    const double off = 1e-12 * (1 + uv.norm());
    if (!shape.rest->u.is_periodic() &&
        !(uv.x() >= shape.rest->u.lower() - off && uv.x() <= shape.rest->u.upper() + off))
      return "parameters beyond the surface";
    if (!shape.rest->v.is_periodic() &&
        !(uv.y() >= shape.rest->v.lower() - off && uv.y() <= shape.rest->v.upper() + off))
      return "parameters beyond the surface";
  }
  for (const geometry::Vec3& value : *icon.reference) {
    if (!value.allFinite()) return "a reference of no numbers";
  }
  if (!icon.translation.allFinite() || !icon.pivot.allFinite()) return "a motion of no numbers";
  if (!(std::abs(icon.rotation.norm() - 1) <= 1e-12)) return "a rotation that is none";
  if (!(icon.stiffness >= 0)) return "a stiffness below 0";
  const geometry::Vec2 uv = shown_at(icon);
  const double off = (icon.place - shape.surface->evaluate(uv.x(), uv.y())).norm();
  if (!(off <= 1e-12 * (1 + size))) return fmt::format("a place that is {} m off the surface (D14)", off);
  return shape.least_squares ? "" : broken_constraint(icon, shape, size);
}

/// What is wrong with the surface, or nothing.
inline std::string broken_sculpt(const SculptShape& shape) {
  if (!shape.initial || !shape.rest || !shape.surface || !shape.icons) return "a surface that is not there";
  for (const auto* surface : {shape.initial.get(), shape.rest.get(), shape.surface.get()}) {
    for (const geometry::Vec3& point : surface->control) {
      if (!point.allFinite()) return "a control point of no numbers";
    }
  }
  const geometry::BSplineSurface& rest = *shape.rest;
  const geometry::BSplineSurface& surface = *shape.surface;
  if (surface.u.knots() != rest.u.knots() || surface.v.knots() != rest.v.knots() ||
      surface.weights != rest.weights || surface.control.size() != rest.control.size())
    return "a surface of other knots than the one at rest";
  const auto movable = geometry::movable_points(rest.u, rest.v, shape.supports);
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < rest.control.size(); ++i) {
    if (next < movable.size() && movable[next] == i) {
      ++next;
    } else if (surface.control[i] != rest.control[i]) {
      return fmt::format("control point {} of a held side that moved", i);
    }
  }
  const double size = std::max(size_of(rest), size_of(surface));
  std::set<std::string> ids;
  bool acting = shape.absolute;
  for (const SculptIcon& icon : *shape.icons) {
    if (!ids.insert(icon.id).second) return "two icons of one id";
    acting = acting || icon.acts();
    if (const std::string broken = broken_icon(icon, shape, size); !broken.empty())
      return fmt::format("icon {}: {}", icon.id, broken);
  }
  if (!acting && surface.control != rest.control) return "a surface that is not at rest while nothing acts";
  return "";
}

}  // namespace handloft::model::test
