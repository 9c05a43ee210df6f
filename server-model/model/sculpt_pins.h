#pragma once
// Curves and regions that hold surfaces too large to keep the answer to each of their rows: they become pins
// of the solver (geometry/stiffness_pins.h), and their motions fields of those. A drag changes the fields'
// amounts alone: a translation is one field, a rotation three, each bend one, and three are what the surface
// was off its rest when the icon began to act.

#include <cstddef>
#include <vector>

#include "server-model/geometry/sculpt_rows.h"
#include "server-model/geometry/sculpt_system.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

struct PinnedIcons {
  geometry::StiffnessPins pins;
  std::vector<geometry::SculptField> fields;
  std::vector<std::size_t> owner;      ///< By pin: index of the icon.
  std::vector<geometry::Vec3> target;  ///< By pin.
  std::vector<double> tolerance_m;     ///< By pin: SculptRow::tolerance.
};

/// Takes the rows of curves and regions that are held exactly out of `rows` and its `owner`s.
PinnedIcons take_pins(const SculptShape& shape, std::vector<geometry::SculptRow>& rows,
                      std::vector<std::size_t>& owner);

/// How far a pin is from its target under a solution, in metres.
double pin_off(const PinnedIcons& pinned, std::size_t pin, const std::vector<geometry::Vec3>& control);

}  // namespace handloft::model
