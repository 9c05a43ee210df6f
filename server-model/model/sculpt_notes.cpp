#include "server-model/model/sculpt_notes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "server-model/model/sculpt_icon.h"
#include "server-model/model/sculpt_pins.h"

namespace handloft::model {

using geometry::Vec2;
using geometry::Vec3;

namespace {

/// Of the diagonal: a deviation below it is nobody's concern.
constexpr double worth_saying = 1e-7;
/// Of the diagonal: what a pin that follows from others may be off (as SculptSystem's rows).
constexpr double least_conflict = 1e-9;
/// Of what a load was dragged by: less is rounding.
constexpr double nothing = 1e-12;

/// The sides that hold, as operations name them; empty: none.
std::string held_sides(const SculptShape& shape) {
  std::vector<std::string> names;
  const auto add = [&](const geometry::KnotVector& knots, geometry::Support support, const char* name) {
    if (knots.is_periodic() || support == geometry::Support::free) return;
    names.push_back(fmt::format("{} {}", name,
                                support == geometry::Support::clamped ? "EDGE_CLAMPED" : "EDGE_SUPPORTED"));
  };
  add(shape.rest->u, shape.supports.u_lower, "uLower");
  add(shape.rest->u, shape.supports.u_upper, "uUpper");
  add(shape.rest->v, shape.supports.v_lower, "vLower");
  add(shape.rest->v, shape.supports.v_upper, "vUpper");
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Two points so close together that they tilt the surface between them by more than this (a rise over a
/// run) are looked at for waves elsewhere.
constexpr double steep = 0.5;
/// Waves are what goes farther than anything asked for, by this factor.
constexpr double wave = 5;
/// What was said is said again when it has become worse by this factor.
constexpr double worse = 2;

/// Held places that lie so close together that the surface swings elsewhere.
std::optional<Told> steep_pair(const SculptShape& shape) {
  struct Held {
    const SculptIcon* icon;
    Vec3 rest, by;
  };
  std::vector<Held> held;
  double asked = 0;
  if (shape.absolute) return std::nullopt;
  for (const SculptIcon& icon : *shape.icons) {
    if (!icon.acts() || (icon.role == IconRole::load && !has_moved(icon))) continue;
    const bool is_place = icon.shape != IconShape::point || icon.role == IconRole::load ||
                          icon.property == IconProperty::position;
    if (!is_place) {
      if (has_moved(icon)) return std::nullopt;  // What it asks for is no distance.
      continue;
    }
    const Vec2& uv = icon.parameters.front();
    if (icon.shape == IconShape::point && icon.role == IconRole::constraint) {
      const Vec3 rest = shape.rest->evaluate(uv.x(), uv.y());
      const Vec3 target =
          icon.pivot + icon.rotation * (icon.reference->front() - icon.pivot) + icon.translation;
      held.push_back({&icon, rest, target - rest});
      asked = std::max(asked, held.back().by.norm());
      continue;
    }
    double by = icon.translation.norm();
    for (const IconBend& bend : icon.bends) by += bend.translation.norm();
    if (icon.rotation.vec() != Vec3::Zero()) return std::nullopt;
    asked = std::max(asked, by);
  }
  double steepest = steep;
  const Held* one = nullptr;
  const Held* two = nullptr;
  for (std::size_t j = 1; j < held.size(); ++j) {
    for (std::size_t i = 0; i < j; ++i) {
      const double run = (held[j].rest - held[i].rest).norm();
      const double rise = (held[j].by - held[i].by).norm();
      if (!(run > 0) || !(rise > steepest * run)) continue;
      steepest = rise / run;
      one = &held[i];
      two = &held[j];
    }
  }
  if (one == nullptr) return std::nullopt;
  double most = 0;
  for (std::size_t i = 0; i < shape.rest->control.size(); ++i)
    most = std::max(most, (shape.surface->control[i] - shape.rest->control[i]).norm());
  if (!(most > wave * asked)) return std::nullopt;
  Told told{{two->icon->id, IconRemark::Kind::steep, most}, {}, one->icon->id};
  told.note = fmt::format(
      "icons \"{}\" and \"{}\" lie {:.3g} mm apart and pull the surface {:.3g} cm, where {:.3g} cm at most "
      "are "
      "asked for; move them apart or delete one",
      one->icon->id, two->icon->id, 1e3 * (two->rest - one->rest).norm(), 1e2 * most, 1e2 * asked);
  return told;
}

}  // namespace

Error contradiction(const Conflicts& conflicts, const SculptShape& shape, std::string_view field) {
  std::vector<std::string> names;
  for (const auto& [icon, off] : conflicts)
    names.push_back(fmt::format("icon \"{}\" (off by {:.3g})", (*shape.icons)[icon].id, off));
  const SculptIcon& last = (*shape.icons)[conflicts.rbegin()->first];
  const std::string sides = held_sides(shape);
  if (conflicts.size() > 1 || last.shape == IconShape::point || sides.empty()) {
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("found constraints that contradict each other{}: {}; expected ones that can "
                    "be met together",
                    conflicts.size() == 1 ? " or what the sides hold" : "", fmt::join(names, ", ")),
        std::string(field));
  }
  std::vector<std::string> others;
  for (const SculptIcon& icon : *shape.icons)
    if (icon.acts() && icon.role == IconRole::constraint && &icon != &last)
      others.push_back(fmt::format("\"{}\"", icon.id));
  return make_error(
      ErrorCode::failed_precondition,
      fmt::format("found {}: {} x {} control points are too few for it beside the sides that hold ({}){}; "
                  "expected more of them (refineSurface), sides that are EDGE_FREE or EDGE_SUPPORTED "
                  "(setSculpting), or a {} that keeps away from them",
                  names.front(), shape.rest->u.control_count(), shape.rest->v.control_count(), sides,
                  others.empty() ? "" : fmt::format(" and {}", fmt::join(others, ", ")),
                  to_string(last.shape)),
      std::string(field));
}

std::vector<Told> remarks_of(const geometry::SculptSolution& solution, const Demands& demands,
                             const SculptShape& shape, double diagonal_m, const Conflicts& conflicts) {
  std::vector<Told> told;
  const auto tell = [&](std::size_t icon, IconRemark::Kind kind, double off, std::string note) {
    told.push_back({{(*shape.icons)[icon].id, kind, off}, std::move(note), {}});
  };
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
    if (rows[i] > 0 && rows[i] == following[i])
      tell(i, IconRemark::Kind::adds_nothing, 0,
           fmt::format("icon \"{}\" adds nothing to what others and the sides hold", (*shape.icons)[i].id));
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
    const SculptIcon& icon = (*shape.icons)[i];
    if (off[i] > 0) {
      // Pins are kept or left out, in their order; rows share what cannot be met.
      const bool is_pinned = std::find(demands.pinned.owner.begin(), demands.pinned.owner.end(), i) !=
                             demands.pinned.owner.end();
      tell(i, IconRemark::Kind::off, off[i],
           fmt::format("icon \"{}\" {}, off by {:.3g}", icon.id,
                       is_pinned ? "yields to what came before it" : "is met in the mean only", off[i]));
    } else if (apart[i] > worth_saying * diagonal_m && icon.shape != IconShape::point &&
               !(icon.stiffness > 0)) {
      tell(i, IconRemark::Kind::followed, apart[i],
           fmt::format("icon \"{}\" is followed to within {:.3g} m", icon.id, apart[i]));
    }
  }
  if (auto pair = steep_pair(shape)) told.push_back(*std::move(pair));
  return told;
}

void note_icons(std::vector<Told> told, SculptShape& shape, std::string_view worked_on,
                std::vector<std::string>& notes) {
  std::vector<IconRemark> said;
  for (Told& each : told) {
    const auto known =
        std::find_if(shape.remarks.begin(), shape.remarks.end(), [&](const IconRemark& before) {
          return before.icon == each.remark.icon && before.kind == each.remark.kind;
        });
    const bool is_own = !worked_on.empty() && (each.remark.icon == worked_on || each.other == worked_on);
    if (!is_own && known != shape.remarks.end() && each.remark.off <= worse * known->off) {
      said.push_back(*known);
      continue;
    }
    notes.push_back(std::move(each.note));
    said.push_back(std::move(each.remark));
  }
  shape.remarks = std::move(said);
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

void note_held_loads(const SculptShape& shape, std::vector<std::string>& notes) {
  for (const SculptIcon& icon : *shape.icons) {
    if (icon.role != IconRole::load || !icon.acts() || !has_moved(icon)) continue;
    const Vec2 uv = icon_middle(icon);
    const double by = (shape.surface->evaluate(uv.x(), uv.y()) - shape.rest->evaluate(uv.x(), uv.y())).norm();
    const double turn = (shape.surface->normal(uv.x(), uv.y()) - shape.rest->normal(uv.x(), uv.y())).norm();
    if (by <= nothing * icon.translation.norm() && turn <= nothing) {
      notes.push_back(fmt::format("load \"{}\" moves nothing: what it acts on is held", icon.id));
    }
  }
}

}  // namespace handloft::model
