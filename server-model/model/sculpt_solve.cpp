#include "server-model/model/sculpt_solve.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "server-model/geometry/falloff.h"
#include "server-model/geometry/region_border.h"
#include "server-model/geometry/sculpt_rows.h"
#include "server-model/geometry/sculpt_spring.h"
#include "server-model/geometry/sculpt_system.h"
#include "server-model/model/sculpt_border.h"
#include "server-model/model/sculpt_pins.h"
#include "server-model/model/sculpt_solvers.h"

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
/// Of the diagonal: a deviation below it is nobody's concern.
constexpr double worth_saying = 1e-7;
/// Of the diagonal: what a pin that follows from others may be off (as SculptSystem's rows).
constexpr double least_conflict = 1e-9;
/// Of what a load was dragged by: less is rounding.
constexpr double nothing = 1e-12;

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

/// Orders of the derivative that an icon is about.
std::array<int, 2> orders(IconProperty property) {
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

Vec3 value_of(const SurfaceFunctional& functional, const BSplineSurface& surface) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < functional.point.size(); ++k) {
    sum += functional.value[k] * surface.control[functional.point[k]];
  }
  return sum;
}

/// Where an icon is shown: its parameters, or the middle of them.
Vec2 middle(const SculptIcon& icon) {
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

/// Of a region constraint that does not hold control points.
Result<std::vector<CurvePlace>> region_places(const SculptIcon& icon, const BSplineSurface& rest) {
  return region_hold(icon, rest) == RegionHold::spring ? geometry::area_quadrature(rest, region_of(icon))
                                                       : geometry::region_places(rest, region_of(icon));
}

/// Rows and loads of all icons, and whose each row is.
struct Demands {
  std::vector<SculptRow> rows;
  std::vector<std::size_t> owner;  ///< Of each row: index of the icon.
  std::vector<SculptLoad> loads;
  std::vector<std::uint32_t> held;
  PinnedIcons pinned;  ///< Of surfaces so large, or icons that hold so much, that rows would be too many.
  std::vector<std::size_t> dependent_pins;  ///< After the solution.
};

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
        const auto [a, b] = orders(icon.property);
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
      auto places = region_places(icon, rest);
      if (!places) return places.error();
      return take(icon.stiffness > 0
                      ? geometry::spring_rows(rest, *places, targets, icon.stiffness)
                      : geometry::curve_rows(rest, *places, targets, curve_tolerance * diagonal_m));
    }
  }
  return {};
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
    reference.push_back(value_of(*functional, rest));
    functionals.push_back(std::move(*functional));
  }
  const std::vector<Vec3> targets = curve_targets(icon, rest, reference);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double share = places[i].weight_m / whole;
    loads.push_back({std::move(functionals[i]), stiffness * share * (targets[i] - reference[i])});
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

/// The solver names its own fields; people know the operation's.
Error under(Error error, std::string_view field) {
  if (!error.field.empty()) error.message = fmt::format("{}: {}", error.field, error.message);
  error.field = std::string(field);
  return error;
}

/// How far each icon is off, where it is more than it may be (D20).
using Conflicts = std::map<std::size_t, double>;

Error contradiction(const Conflicts& conflicts, const SculptShape& shape, std::string_view field) {
  std::vector<std::string> names;
  for (const auto& [icon, off] : conflicts)
    names.push_back(fmt::format("icon \"{}\" (off by {:.3g})", (*shape.icons)[icon].id, off));
  return make_error(
      ErrorCode::failed_precondition,
      fmt::format("icon \"{}\": found constraints that contradict each other: {}; expected ones "
                  "that can be met together",
                  (*shape.icons)[conflicts.rbegin()->first].id, fmt::join(names, ", ")),
      std::string(field));
}

void note_rows(const geometry::SculptSolution& solution, const Demands& demands, const SculptShape& shape,
               double diagonal_m, const Conflicts& conflicts, std::vector<std::string>& notes) {
  // An icon is worth a word when nothing of it is its own.
  std::vector<std::size_t> rows(shape.icons->size(), 0), following(shape.icons->size(), 0);
  for (const std::size_t owner : demands.owner) ++rows[owner];
  for (const std::size_t owner : demands.pinned.owner) ++rows[owner];
  for (const std::size_t pin : demands.dependent_pins) ++following[demands.pinned.owner[pin]];
  for (const geometry::DependentRow& each : solution.dependent) {
    const std::size_t owner = demands.owner[each.row];
    const bool on_others = std::any_of(each.on.begin(), each.on.end(),
                                       [&](std::size_t on) { return demands.owner[on] != owner; });
    if (on_others || each.on.empty()) ++following[owner];
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i] > 0 && rows[i] == following[i]) {
      notes.push_back(
          fmt::format("icon \"{}\" adds nothing to what others and the sides hold", (*shape.icons)[i].id));
    }
  }
  // D9: how nearly a curve is followed where it asks for more than there are control points.
  std::vector<double> apart(shape.icons->size(), 0.0);
  for (std::size_t i = 0; i < solution.off.size(); ++i) {
    double& most = apart[demands.owner[i]];
    most = std::max(most, solution.off[i]);
  }
  std::vector<double> off(shape.icons->size(), 0.0);
  for (const auto& [icon, most] : conflicts) off[icon] = most;
  for (std::size_t i = 0; i < off.size(); ++i) {
    if (off[i] > 0) {
      notes.push_back(
          fmt::format("icon \"{}\" is met in the mean only, off by {:.3g}", (*shape.icons)[i].id, off[i]));
    } else if (apart[i] > worth_saying * diagonal_m && (*shape.icons)[i].shape != IconShape::point &&
               !((*shape.icons)[i].stiffness > 0)) {
      notes.push_back(
          fmt::format("icon \"{}\" is followed to within {:.3g} m", (*shape.icons)[i].id, apart[i]));
    }
  }
}

Conflicts conflicts_of(const geometry::SculptSolution& solution, const Demands& demands, double diagonal_m) {
  Conflicts conflicts;
  const auto add = [&](std::size_t icon, double off) {
    double& most = conflicts[icon];
    most = std::max(most, off);
  };
  for (const geometry::SculptConflict& each : solution.conflicts) add(demands.owner[each.row], each.off);
  for (const std::size_t pin : demands.dependent_pins) {
    const double off = pin_off(demands.pinned, pin, solution.control);
    const double tolerance_m = demands.pinned.tolerance_m[pin];
    if (off > (tolerance_m > 0 ? tolerance_m : least_conflict * diagonal_m))
      add(demands.pinned.owner[pin], off);
  }
  return conflicts;
}

/// Loads on what sides, regions or other icons hold: they push at nothing.
void note_held_loads(const SculptShape& shape, std::vector<std::string>& notes) {
  for (const SculptIcon& icon : *shape.icons) {
    if (icon.role != IconRole::load || !icon.acts() || !has_moved(icon)) continue;
    const Vec2 uv = middle(icon);
    const double by = (shape.surface->evaluate(uv.x(), uv.y()) - shape.rest->evaluate(uv.x(), uv.y())).norm();
    const double turn = (shape.surface->normal(uv.x(), uv.y()) - shape.rest->normal(uv.x(), uv.y())).norm();
    if (by <= nothing * icon.translation.norm() && turn <= nothing) {
      notes.push_back(fmt::format("load \"{}\" moves nothing: what it acts on is held", icon.id));
    }
  }
}

/// Whether loads act that have not been dragged yet.
bool waits(const SculptShape& shape) {
  return std::any_of(shape.icons->begin(), shape.icons->end(), [](const SculptIcon& icon) {
    return icon.role == IconRole::load && icon.acts() && !has_moved(icon);
  });
}

/// What a load's first drag would wait for: the answer to its push (D16), a second and more of a surface of a
/// million control points. No result depends on it, nor on whether it works.
void make_ready(const SculptIcon& icon, const BSplineSurface& rest, const Demands& demands,
                geometry::SculptSystem& system) {
  SculptIcon pushed = icon;
  pushed.translation = Vec3::UnitZ();
  pushed.stiffness = 0;
  std::vector<SculptLoad> loads;
  if (!add_load(pushed, rest, demands, system, loads)) return;
}

/// Whether more may move than is factorised.
bool is_large(const SculptShape& shape, const std::vector<std::uint32_t>& held, std::size_t direct_unknowns) {
  if (shape.rest->control.size() <= direct_unknowns) return false;
  // Counted, not listed: this is asked in every frame of a drag.
  const auto range = [](const geometry::KnotVector& knots, geometry::Support lower, geometry::Support upper) {
    const auto count = static_cast<std::size_t>(knots.control_count());
    if (knots.is_periodic()) return std::pair<std::size_t, std::size_t>{0, count};
    const auto last = static_cast<std::size_t>(upper);
    return std::pair<std::size_t, std::size_t>{static_cast<std::size_t>(lower),
                                               count > last ? count - last : 0};
  };
  const auto rows = range(shape.rest->u, shape.supports.u_lower, shape.supports.u_upper);
  const auto columns = range(shape.rest->v, shape.supports.v_lower, shape.supports.v_upper);
  const auto size = [](const auto& part) { return part.second > part.first ? part.second - part.first : 0; };
  const auto within = [](std::size_t at, const auto& part) { return at >= part.first && at < part.second; };
  const auto across = static_cast<std::size_t>(shape.rest->v.control_count());
  const auto fixed = std::count_if(held.begin(), held.end(), [&](std::uint32_t point) {
    return within(point / across, rows) && within(point % across, columns);
  });
  return size(rows) * size(columns) - static_cast<std::size_t>(fixed) > direct_unknowns;
}

void update_places(SculptShape& shape) {
  auto icons = std::make_shared<std::vector<SculptIcon>>(*shape.icons);
  for (SculptIcon& icon : *icons) {
    const Vec2 uv = middle(icon);
    icon.place = shape.surface->evaluate(uv.x(), uv.y());
  }
  shape.icons = std::move(icons);
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

Status begin_icon(SculptIcon& icon, const SculptShape& shape, std::string_view field, const Limits& limits) {
  const BSplineSurface& surface = *shape.surface;
  const auto below = [&](Error error) {
    error.field = error.field.empty() ? std::string(field) : fmt::format("{}.{}", field, error.field);
    return error;
  };
  const Vec2 uv = middle(icon);
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
    const auto [a, b] = orders(icon.property);
    auto functional = geometry::surface_functional(surface, uv.x(), uv.y(), a, b);
    if (!functional) return below(functional.error());
    reference->push_back(value_of(*functional, surface));
  } else if (icon.shape == IconShape::curve ||
             (!icon.outside && region_hold(icon, *shape.rest) != RegionHold::points)) {
    auto places = icon.shape == IconShape::curve ? geometry::collocation_places(*shape.rest, icon.parameters)
                                                 : region_places(icon, *shape.rest);
    if (!places) return below(places.error());
    for (const CurvePlace& place : *places) {
      auto functional = geometry::surface_functional(surface, place.uv.x(), place.uv.y(), 0, 0);
      if (!functional) return below(functional.error());
      reference->push_back(value_of(*functional, surface));
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

Status settle(SculptShape& shape, std::string_view field, const ApplyContext& context,
              std::vector<std::string>& notes) {
  const BSplineSurface& rest = *shape.rest;
  Demands demands;
  bool loaded = shape.absolute;
  SculptSolvers once(1);
  SculptSolvers& solvers = context.sculpt_solvers ? *context.sculpt_solvers : once;
  const double diagonal_m = solvers.diagonal_m(shape.rest);
  for (std::size_t i = 0; i < shape.icons->size(); ++i) {
    const SculptIcon& icon = (*shape.icons)[i];
    if (!icon.acts()) continue;
    if (icon.role == IconRole::load) {
      loaded = loaded || has_moved(icon);
    } else if (icon.outside) {
      auto held = geometry::points_outside(rest, region_of(icon));
      if (!held) return under(held.error(), field);
      demands.held.insert(demands.held.end(), held->begin(), held->end());
    } else if (auto status = add_constraint(icon, i, rest, diagonal_m, demands); !status) {
      return under(status.error(), field);
    }
  }
  std::sort(demands.held.begin(), demands.held.end());
  demands.held.erase(std::unique(demands.held.begin(), demands.held.end()), demands.held.end());
  const bool still = demands.rows.empty() && !loaded;
  if (still) {
    shape.surface = shape.rest;  // To the bit (D4, D19).
    update_places(shape);
    if (!context.sculpt_solvers || !waits(shape)) return {};
  }

  if (demands.rows.size() > context.limits.max_constraint_rows ||
      is_large(shape, demands.held, solvers.iteration().direct_unknowns)) {
    demands.pinned = take_pins(shape, demands.rows, demands.owner);
  }
  if (demands.rows.size() > context.limits.max_constraint_rows) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("the icons of \"{}\" hold {} places, expected at most {}", shape.id,
                                  demands.rows.size(), context.limits.max_constraint_rows),
                      std::string(field));
  }

  geometry::SculptSetup setup;
  setup.energy = shape.energy;
  setup.supports = shape.supports;
  setup.mode = shape.absolute ? geometry::SculptMode::absolute_fairing : geometry::SculptMode::displacement;
  setup.held = demands.held;
  setup.pins = demands.pinned.pins;
  std::optional<geometry::SculptSolution> solution;
  const auto use = [&](geometry::SculptSystem& system) -> Status {
    for (const SculptIcon& icon : *shape.icons) {
      if (icon.role != IconRole::load || !icon.acts()) continue;
      if (auto status = add_load(icon, rest, demands, system, demands.loads); !status) return status;
    }
    for (const SculptIcon& icon : *shape.icons) {
      if (icon.role == IconRole::load && icon.acts() && !has_moved(icon))
        make_ready(icon, rest, demands, system);
    }
    if (still) return {};
    // Whoever contradicts is named below, by icons.
    auto solved = system.solve(demands.rows, demands.loads, demands.pinned.fields,
                               geometry::ConflictPolicy::least_squares, geometry::SculptDetail::shape,
                               solvers.buffers().take(rest.control.size()));
    if (!solved) return solved.error();
    solution = std::move(*solved);
    demands.dependent_pins = system.dependent_pins();
    return {};
  };
  const Status used = solvers.with(shape.rest, setup, context.parallel, use);
  if (still) return {};  // What is wrong is for those to hear who drag.
  if (const Status& status = used; !status) {
    if (!demands.held.empty() && status.error().field == "supports" &&
        status.error().code == ErrorCode::invalid_argument) {
      return make_error(
          ErrorCode::failed_precondition,
          "the outside of a region and the sides leave no control point free, expected a larger "
          "region or more control points (refine_surface)",
          std::string(field));
    }
    return under(status.error(), field);
  }
  const Conflicts conflicts = conflicts_of(*solution, demands, diagonal_m);
  if (!conflicts.empty() && !shape.least_squares) return contradiction(conflicts, shape, field);
  if (!(solution->farthest_m <= context.limits.max_coordinate_m)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("would move \"{}\" out of the workspace of {} m", shape.id,
                                  context.limits.max_coordinate_m),
                      std::string(field));
  }
  if (solution->moved) {
    shape.surface = solvers.buffers().share({rest.u, rest.v, std::move(solution->control), rest.weights});
  } else {
    shape.surface = shape.rest;
  }
  update_places(shape);
  note_rows(*solution, demands, shape, diagonal_m, conflicts, notes);
  note_held_loads(shape, notes);
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
  const Vec2 uv = middle(icon);
  const auto [a, b] = orders(icon.property);
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
