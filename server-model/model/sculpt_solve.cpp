#include "server-model/model/sculpt_solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "server-model/geometry/sculpt_system.h"
#include "server-model/model/sculpt_border.h"
#include "server-model/model/sculpt_demands.h"
#include "server-model/model/sculpt_icon.h"
#include "server-model/model/sculpt_notes.h"
#include "server-model/model/sculpt_pins.h"
#include "server-model/model/sculpt_solvers.h"

namespace handloft::model {

using geometry::BSplineSurface;
using geometry::Vec2;

namespace {

/// The solver names its own fields; people know the operation's.
Error under(Error error, std::string_view field) {
  if (!error.field.empty()) error.message = fmt::format("{}: {}", error.field, error.message);
  error.field = std::string(field);
  return error;
}

/// Whether loads act that have not been dragged yet.
bool waits(const SculptShape& shape) {
  return std::any_of(shape.icons->begin(), shape.icons->end(), [](const SculptIcon& icon) {
    return icon.role == IconRole::load && icon.acts() && !has_moved(icon);
  });
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

/// A row is one equation with three right sides; where one couples x, y and z, all the others are three.
std::size_t equation_count(const std::vector<geometry::SculptRow>& rows) {
  const auto coupling = static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [](const auto& row) { return row.along.has_value(); }));
  return coupling == 0 ? rows.size() : 3 * (rows.size() - coupling) + coupling;
}

/// Of a load as stiff as no surface is.
std::optional<Error> too_stiff(const SculptShape& shape, std::string_view field) {
  const SculptIcon* stiffest = nullptr;
  for (const SculptIcon& icon : *shape.icons)
    if (icon.role == IconRole::load && icon.acts() && has_moved(icon) && icon.stiffness > 0 &&
        (stiffest == nullptr || icon.stiffness > stiffest->stiffness))
      stiffest = &icon;
  if (stiffest == nullptr) return std::nullopt;
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("load \"{}\": its stiffness of {:.3g} N/m would move \"{}\" out of the "
                                "workspace, expected less, or 0 for one that follows the hand",
                                stiffest->id, stiffest->stiffness, shape.id),
                    std::string(field));
}

void update_places(SculptShape& shape) {
  auto icons = std::make_shared<std::vector<SculptIcon>>(*shape.icons);
  for (SculptIcon& icon : *icons) {
    const Vec2 uv = icon_middle(icon);
    icon.place = shape.surface->evaluate(uv.x(), uv.y());
  }
  shape.icons = std::move(icons);
}

}  // namespace

Status settle(SculptShape& shape, std::string_view field, const ApplyContext& context,
              std::vector<std::string>& notes, std::string_view worked_on) {
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
    shape.remarks.clear();
    update_places(shape);
    if (!context.sculpt_solvers || !waits(shape)) return {};
  }

  if (equation_count(demands.rows) > context.limits.max_constraint_rows ||
      is_large(shape, demands.held, solvers.iteration().direct_unknowns)) {
    demands.pinned = take_pins(shape, demands.rows, demands.owner);
  }
  if (const std::size_t equations = equation_count(demands.rows);
      equations > context.limits.max_constraint_rows) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("the icons of \"{}\" ask for {} equations (3 a place where a normal is "
                                  "held), expected at most {}: delete icons or let them sleep, draw shorter "
                                  "curves, or commit (end_sculpting) and go on with fewer",
                                  shape.id, equations, context.limits.max_constraint_rows),
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
    if (status.error().field == "supports" && status.error().code == ErrorCode::invalid_argument) {
      return make_error(ErrorCode::failed_precondition,
                        fmt::format("the sides of \"{}\" hold all of its {} x {} control points, expected "
                                    "more (refineSurface) or sides that are free (setSculpting, EDGE_FREE)",
                                    shape.id, rest.u.control_count(), rest.v.control_count()),
                        std::string(field));
    }
    if (status.error().field == "pins" && status.error().code == ErrorCode::resource_exhausted) {
      Error error = under(status.error(), field);
      error.message +=
          ": delete icons or let them sleep, draw shorter curves, or commit and go on with fewer";
      return error;
    }
    if (status.error().field == "rows") {
      if (auto error = too_stiff(shape, field)) return *error;
    }
    return under(status.error(), field);
  }
  const bool within = solution->farthest_m <= context.limits.max_coordinate_m;
  if (!within) {
    if (auto error = too_stiff(shape, field)) return *error;
  }
  const Conflicts conflicts = conflicts_of(*solution, demands, diagonal_m);
  if (!conflicts.empty() && !shape.least_squares) return contradiction(conflicts, shape, field);
  if (!within) {
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
  note_icons(remarks_of(*solution, demands, shape, diagonal_m, conflicts), shape, worked_on, notes);
  note_held_loads(shape, notes);
  return {};
}

}  // namespace handloft::model
