#include "server-model/model/sculpt_demands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server-model/geometry/falloff.h"
#include "server-model/geometry/region_border.h"
#include "server-model/geometry/sculpt_spring.h"
#include "server-model/model/sculpt_border.h"
#include "server-model/model/sculpt_icon.h"

namespace handloft::model {

using geometry::BSplineSurface;
using geometry::CurvePlace;
using geometry::SculptLoad;
using geometry::SculptRow;
using geometry::SurfaceFunctional;
using geometry::Vec2;
using geometry::Vec3;

namespace {

/// D9: a curve that the surface has not enough control points for may be off by this part of its diagonal.
constexpr double curve_tolerance = 1e-4;
/// And by this part of how far it was moved: near a side that holds, a coarse surface cannot follow at all.
constexpr double curve_lag = 0.1;
geometry::PointAspect aspect_of(IconProperty property) {
  switch (property) {
    case IconProperty::tangent_u:
      return geometry::PointAspect::tangent_u;
    case IconProperty::tangent_v:
      return geometry::PointAspect::tangent_v;
    case IconProperty::second_u:
      return geometry::PointAspect::second_u;
    case IconProperty::second_v:
      return geometry::PointAspect::second_v;
    case IconProperty::twist:
      return geometry::PointAspect::twist;
    case IconProperty::position:
    case IconProperty::normal:
      break;
  }
  return geometry::PointAspect::position;
}

Vec3 moved(const SculptIcon& icon, const Vec3& place) {
  if (icon.rotation.vec() == Vec3::Zero()) return place + icon.translation;
  return icon.pivot + icon.rotation * (place - icon.pivot) + icon.translation;
}

Eigen::Isometry3d motion_of(const SculptIcon& icon) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = icon.rotation.toRotationMatrix();
  motion.translation() = icon.pivot - icon.rotation * icon.pivot + icon.translation;
  return motion;
}

/// The same place, turns of closed directions apart.
bool is_closed(const SculptIcon& icon, const BSplineSurface& rest) {
  const Vec2 step = icon.parameters.back() - icon.parameters.front();
  const auto returns = [](const geometry::KnotVector& knots, double by) {
    if (!knots.is_periodic()) return by == 0;
    return std::abs(by - knots.length() * std::round(by / knots.length())) <=
           geometry::same_parameter * knots.length();
  };
  return returns(rest.u, step.x()) && returns(rest.v, step.y());
}

/// Where the places of a curve icon are to be: moved, then bent.
std::vector<Vec3> curve_targets(const SculptIcon& icon, const BSplineSurface& rest,
                                const std::vector<Vec3>& reference) {
  std::vector<Vec3> targets;
  targets.reserve(reference.size());
  for (const Vec3& place : reference) targets.push_back(moved(icon, place));
  for (const IconBend& bend : icon.bends) {
    const std::vector<double> weight = bend_weights(icon, bend, rest, reference);
    for (std::size_t i = 0; i < reference.size(); ++i) targets[i] += weight[i] * bend.translation;
  }
  return targets;
}

/// The stiffness with which loads of unit force, or moment, move what they act on as far as they are meant to
/// (D16). 0: where constraints let nothing move.
Result<double> stiffness_for(const SculptIcon& icon, const Demands& demands, std::span<const SculptLoad> unit,
                             geometry::SculptSystem& system) {
  if (icon.stiffness > 0) return icon.stiffness;
  auto compliance = system.compliance(demands.rows, unit);
  if (!compliance) return compliance.error();
  auto stiffness = geometry::matching_stiffness(*compliance);
  return stiffness ? *stiffness : 0.0;
}

Status add_bent_load(const SculptIcon& icon, const BSplineSurface& rest, std::span<const CurvePlace> places,
                     double stiffness, std::vector<SculptLoad>& loads) {
  double whole = 0;
  for (const CurvePlace& place : places) whole += place.weight_m;
  std::vector<SurfaceFunctional> functionals;
  std::vector<Vec3> reference;
  for (const CurvePlace& place : places) {
    auto functional = geometry::surface_functional(rest, place.uv.x(), place.uv.y(), 0, 0);
    if (!functional) return functional.error();
    reference.push_back(value_of(*functional, rest.control));
    functionals.push_back(std::move(*functional));
  }
  const std::vector<Vec3> targets = curve_targets(icon, rest, reference);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double share = places[i].weight_m / whole;
    loads.push_back({std::move(functionals[i]), stiffness * share * (targets[i] - reference[i])});
  }
  return {};
}

}  // namespace

std::vector<double> bend_weights(const SculptIcon& icon, const IconBend& bend, const BSplineSurface& rest,
                                 const std::vector<Vec3>& reference) {
  std::vector<double> along(reference.size(), 0.0);
  for (std::size_t i = 1; i < reference.size(); ++i) {
    along[i] = along[i - 1] + (reference[i] - reference[i - 1]).norm();
  }
  const double length = along.back();
  const bool closed = is_closed(icon, rest);
  std::vector<double> weight;
  weight.reserve(reference.size());
  for (const double at : along) {
    double distance = std::abs(at - bend.held_at * length);
    if (closed) distance = std::min(distance, length - distance);
    weight.push_back(geometry::falloff(distance / bend.reach_m));
  }
  return weight;
}

Status add_constraint(const SculptIcon& icon, std::size_t index, const BSplineSurface& rest,
                      double diagonal_m, Demands& demands) {
  const std::vector<Vec3>& reference = *icon.reference;
  const auto take = [&](auto rows) -> Status {
    if (!rows) return rows.error();
    for (SculptRow& row : *rows) {
      demands.rows.push_back(std::move(row));
      demands.owner.push_back(index);
    }
    return {};
  };
  switch (icon.shape) {
    case IconShape::point: {
      const Vec2& uv = icon.parameters.front();
      if (icon.property == IconProperty::normal) {
        return take(geometry::normal_rows(rest, uv, icon.rotation * reference.front()));
      }
      Vec3 target = moved(icon, reference.front());
      if (icon.property != IconProperty::position) {
        const auto [a, b] = orders_of(icon.property);
        target = icon.rotation * reference.front() + icon.translation / std::pow(icon_arrow_m, a + b);
      }
      auto row = geometry::point_row(rest, uv, aspect_of(icon.property), target);
      if (!row) return row.error();
      demands.rows.push_back(std::move(*row));
      demands.owner.push_back(index);
      return {};
    }
    case IconShape::curve: {
      auto places = geometry::collocation_places(rest, icon.parameters);
      if (!places) return places.error();
      double tolerance_m = curve_tolerance * diagonal_m;
      // A bend is met as nearly as the control points allow, and a motion may lag where they hardly can.
      for (const IconBend& bend : icon.bends) tolerance_m += bend.translation.norm();
      tolerance_m +=
          curve_lag * (icon.translation.norm() + diagonal_m * Eigen::AngleAxisd(icon.rotation).angle());
      return take(geometry::curve_rows(rest, *places, curve_targets(icon, rest, reference), tolerance_m));
    }
    case IconShape::region: {
      std::vector<Vec3> targets;
      targets.reserve(reference.size());
      for (const Vec3& point : reference) targets.push_back(moved(icon, point));
      if (region_hold(icon, rest) == RegionHold::points)
        return take(geometry::region_rows(rest, region_of(icon), targets));
      auto places = places_in_region(icon, rest);
      if (!places) return places.error();
      return take(icon.stiffness > 0
                      ? geometry::spring_rows(rest, *places, targets, icon.stiffness)
                      : geometry::curve_rows(rest, *places, targets, curve_tolerance * diagonal_m));
    }
  }
  return {};
}

Status add_load(const SculptIcon& icon, const BSplineSurface& rest, const Demands& demands,
                geometry::SculptSystem& system, std::vector<SculptLoad>& loads) {
  if (!has_moved(icon)) return {};
  if (icon.shape == IconShape::point) {
    const Vec2& uv = icon.parameters.front();
    if (!icon.translation.isZero(0)) {
      auto unit = geometry::point_load(rest, uv, icon.translation.stableNormalized());
      if (!unit) return unit.error();
      auto stiffness = stiffness_for(icon, demands, std::span(&*unit, 1), system);
      if (!stiffness) return stiffness.error();
      loads.push_back({unit->functional, *stiffness * icon.translation});
    }
    if (icon.rotation.vec() != Vec3::Zero()) {
      const Eigen::AngleAxisd turn(icon.rotation);
      auto unit = geometry::moment_loads(rest, uv, turn.axis());
      if (!unit) return unit.error();
      SculptIcon torsion = icon;
      torsion.stiffness = 0;  // N/m is not of turning.
      auto stiffness = stiffness_for(torsion, demands, *unit, system);
      if (!stiffness) return stiffness.error();
      for (SculptLoad& load : *unit) {
        load.force *= *stiffness * turn.angle();
        loads.push_back(std::move(load));
      }
    }
    return {};
  }
  auto places = icon.shape == IconShape::curve ? geometry::line_quadrature(rest, icon.parameters)
                                               : geometry::area_quadrature(rest, region_of(icon));
  if (!places) return places.error();
  // Measured by a push along the motion of the middle; turning about it alone, along z.
  Eigen::Isometry3d push = Eigen::Isometry3d::Identity();
  Vec3 along = icon.translation;
  for (const IconBend& bend : icon.bends) along += bend.translation;
  push.translation() = along.isZero(0) ? Vec3(Vec3::UnitZ()) : along.stableNormalized();
  auto unit = geometry::motion_loads(rest, *places, push, 1);
  if (!unit) return unit.error();
  auto stiffness = stiffness_for(icon, demands, *unit, system);
  if (!stiffness) return stiffness.error();
  if (!icon.bends.empty()) return add_bent_load(icon, rest, *places, *stiffness, loads);
  auto moved_loads = geometry::motion_loads(rest, *places, motion_of(icon), *stiffness);
  if (!moved_loads) return moved_loads.error();
  for (SculptLoad& load : *moved_loads) loads.push_back(std::move(load));
  return {};
}

void make_ready(const SculptIcon& icon, const BSplineSurface& rest, const Demands& demands,
                geometry::SculptSystem& system) {
  SculptIcon pushed = icon;
  pushed.translation = Vec3::UnitZ();
  pushed.stiffness = 0;
  std::vector<SculptLoad> loads;
  if (!add_load(pushed, rest, demands, system, loads)) return;
}

}  // namespace handloft::model
