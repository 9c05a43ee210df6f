#include "server-model/model/sculpt_notes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "server-model/model/sculpt_icon.h"
#include "server-model/model/sculpt_pins.h"

namespace handloft::model {

using geometry::Vec2;

namespace {

/// Of the diagonal: a deviation below it is nobody's concern.
constexpr double worth_saying = 1e-7;
/// Of the diagonal: what a pin that follows from others may be off (as SculptSystem's rows).
constexpr double least_conflict = 1e-9;
/// Of what a load was dragged by: less is rounding.
constexpr double nothing = 1e-12;

}  // namespace

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
      // Pins are kept or left out, in their order; rows share what cannot be met.
      const bool is_pinned = std::find(demands.pinned.owner.begin(), demands.pinned.owner.end(), i) !=
                             demands.pinned.owner.end();
      notes.push_back(fmt::format("icon \"{}\" {}, off by {:.3g}", (*shape.icons)[i].id,
                                  is_pinned ? "yields to what came before it" : "is met in the mean only",
                                  off[i]));
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
