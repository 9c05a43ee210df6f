#pragma once
// What icons ask of a surface: constraint rows and loads (D5 - D13, D15, D16).

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/sculpt_rows.h"
#include "server-model/geometry/sculpt_system.h"
#include "server-model/model/sculpt_pins.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// Rows and loads of all icons, and whose each row is.
struct Demands {
  std::vector<geometry::SculptRow> rows;
  std::vector<std::size_t> owner;  ///< Of each row: index of the icon.
  std::vector<geometry::SculptLoad> loads;
  std::vector<std::uint32_t> held;
  PinnedIcons pinned;  ///< Of surfaces so large, or icons that hold so much, that rows would be too many.
  std::vector<std::size_t> dependent_pins;  ///< After the solution.
};

/// The rows of icon `index`, which holds. Errors: those of geometry/sculpt_rows.h.
Status add_constraint(const SculptIcon& icon, std::size_t index, const geometry::BSplineSurface& rest,
                      double diagonal_m, Demands& demands);

/// The loads of an icon that pushes, beside what `demands` hold; none where it was not dragged. Errors: those
/// of the system.
Status add_load(const SculptIcon& icon, const geometry::BSplineSurface& rest, const Demands& demands,
                geometry::SculptSystem& system, std::vector<geometry::SculptLoad>& loads);

/// What a load's first drag would wait for: the answer to its push (D16), a second and more of a surface of a
/// million control points. No result depends on it, nor on whether it works.
void make_ready(const SculptIcon& icon, const geometry::BSplineSurface& rest, const Demands& demands,
                geometry::SculptSystem& system);

/// By place of a curve icon, how far it goes with a bend: 1 where it is held, 0 out of reach. `reference`:
/// where the places were.
std::vector<double> bend_weights(const SculptIcon& icon, const IconBend& bend,
                                 const geometry::BSplineSurface& rest,
                                 const std::vector<geometry::Vec3>& reference);

}  // namespace handloft::model
