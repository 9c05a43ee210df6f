#include "server-model/model/sculpt_icon.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "server-model/geometry/region_border.h"
#include "server-model/model/sculpt_border.h"

namespace handloft::model {

using geometry::BSplineSurface;
using geometry::CurvePlace;
using geometry::SurfaceFunctional;
using geometry::Vec2;
using geometry::Vec3;

std::array<int, 2> orders_of(IconProperty property) {
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
    case IconProperty::position:
    case IconProperty::normal:
      break;
  }
  return {0, 0};
}

Vec3 value_of(const SurfaceFunctional& functional, const std::vector<Vec3>& control) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < functional.point.size(); ++k) {
    sum += functional.value[k] * control[functional.point[k]];
  }
  return sum;
}

Vec2 icon_middle(const SculptIcon& icon) {
  switch (icon.shape) {
    case IconShape::point:
      return icon.parameters.front();
    case IconShape::region:
      return (icon.parameters[0] + icon.parameters[1]) / 2;
    case IconShape::curve:
      break;
  }
  double length = 0;
  for (std::size_t i = 1; i < icon.parameters.size(); ++i) {
    length += (icon.parameters[i] - icon.parameters[i - 1]).norm();
  }
  double left = length / 2;
  for (std::size_t i = 1; i < icon.parameters.size(); ++i) {
    const Vec2 step = icon.parameters[i] - icon.parameters[i - 1];
    if (left <= step.norm() && step.norm() > 0) return icon.parameters[i - 1] + left / step.norm() * step;
    left -= step.norm();
  }
  return icon.parameters.back();
}

bool has_moved(const SculptIcon& icon) {
  return !icon.translation.isZero(0) || icon.rotation.vec() != Vec3::Zero() || !icon.bends.empty();
}

Result<std::vector<CurvePlace>> places_in_region(const SculptIcon& icon, const BSplineSurface& rest) {
  return region_hold(icon, rest) == RegionHold::spring ? geometry::area_quadrature(rest, region_of(icon))
                                                       : geometry::region_places(rest, region_of(icon));
}

Status begin_icon(SculptIcon& icon, const SculptShape& shape, std::string_view field, const Limits& limits) {
  const BSplineSurface& surface = *shape.surface;
  const auto below = [&](Error error) {
    error.field = error.field.empty() ? std::string(field) : fmt::format("{}.{}", field, error.field);
    return error;
  };
  const Vec2 uv = icon_middle(icon);
  icon.place = surface.evaluate(uv.x(), uv.y());
  icon.pivot = icon.place;
  icon.translation = Vec3::Zero();
  icon.rotation = Eigen::Quaterniond::Identity();
  icon.bends.clear();
  auto reference = std::make_shared<std::vector<Vec3>>();
  if (icon.role == IconRole::load || (icon.shape == IconShape::region && !icon.acts())) {
    reference->push_back(icon.place);  // Of a region what it holds is known when it acts: then it gets knots.
  } else if (icon.shape == IconShape::point && icon.property == IconProperty::normal) {
    reference->push_back(surface.normal(uv.x(), uv.y()));
    if (reference->front().isZero(0)) {
      return make_error(ErrorCode::failed_precondition, "the surface has no normal there",
                        std::string(field));
    }
  } else if (icon.shape == IconShape::point) {
    const auto [a, b] = orders_of(icon.property);
    auto functional = geometry::surface_functional(surface, uv.x(), uv.y(), a, b);
    if (!functional) return below(functional.error());
    reference->push_back(value_of(*functional, surface.control));
  } else if (icon.shape == IconShape::curve ||
             (!icon.outside && region_hold(icon, *shape.rest) != RegionHold::points)) {
    auto places = icon.shape == IconShape::curve ? geometry::collocation_places(*shape.rest, icon.parameters)
                                                 : places_in_region(icon, *shape.rest);
    if (!places) return below(places.error());
    for (const CurvePlace& place : *places) {
      auto functional = geometry::surface_functional(surface, place.uv.x(), place.uv.y(), 0, 0);
      if (!functional) return below(functional.error());
      reference->push_back(value_of(*functional, surface.control));
    }
  } else if (!icon.outside) {
    auto points = geometry::points_over(*shape.rest, region_of(icon));
    if (!points) return below(points.error());
    for (const std::uint32_t point : *points) reference->push_back(surface.control[point]);
  }
  if (reference->size() > limits.max_control_points) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("would hold {} places, expected at most {}", reference->size(),
                                  limits.max_control_points),
                      std::string(field));
  }
  icon.reference = std::move(reference);
  return {};
}

std::vector<Vec3> icon_outline(const SculptIcon& icon, const BSplineSurface& surface) {
  if (icon.shape == IconShape::point) return {};
  std::vector<Vec2> corners = icon.parameters;
  if (icon.shape == IconShape::region) {
    const Vec2 lower = icon.parameters[0], upper = icon.parameters[1];
    corners = {lower, {upper.x(), lower.y()}, upper, {lower.x(), upper.y()}, lower};
  }
  // As fine as a sixty-fourth of the surface, but no more than needed for long drawn lines.
  const double step = std::hypot(surface.u.length(), surface.v.length()) / 64;
  std::vector<Vec3> outline{surface.evaluate(corners.front().x(), corners.front().y())};
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Vec2 from = corners[i - 1], way = corners[i] - from;
    const int pieces = std::clamp(static_cast<int>(std::ceil(way.norm() / step)), 1, 64);
    for (int k = 1; k <= pieces; ++k) {
      const Vec2 uv = from + static_cast<double>(k) / pieces * way;
      outline.push_back(surface.evaluate(uv.x(), uv.y()));
    }
  }
  return outline;
}

Vec3 icon_direction(const SculptIcon& icon, const BSplineSurface& surface) {
  const Vec2 uv = icon_middle(icon);
  const auto [a, b] = orders_of(icon.property);
  if (icon.role == IconRole::load || a + b == 0) return surface.normal(uv.x(), uv.y());
  const geometry::SurfaceDerivatives at = surface.derivatives(uv.x(), uv.y(), a + b);
  const Vec3 derivative = a == 1 && b == 0   ? at.su
                          : a == 0 && b == 1 ? at.sv
                          : a == 2           ? at.suu
                          : b == 2           ? at.svv
                                             : at.suv;
  return derivative.norm() > 0 ? Vec3(derivative.normalized()) : Vec3(Vec3::Zero());
}

}  // namespace handloft::model
