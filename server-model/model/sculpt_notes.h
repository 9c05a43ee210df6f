#pragma once
// What is said of a solution: which icons contradict each other (D20), add nothing, or are followed only so
// nearly (D9).

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/sculpt_system.h"
#include "server-model/model/sculpt_demands.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// How far each icon is off, where it is more than it may be (D20).
using Conflicts = std::map<std::size_t, double>;
Conflicts conflicts_of(const geometry::SculptSolution& solution, const Demands& demands, double diagonal_m);
/// Names the icons. Precondition: some.
Error contradiction(const Conflicts& conflicts, const SculptShape& shape, std::string_view field);

/// An icon and what is to be said of it.
struct Told {
  IconRemark remark;
  std::string note;
  std::string other;  ///< An icon that it concerns as much; empty: none.
};
/// All that could be said, by icon. Precondition: shape.surface is the solution's.
std::vector<Told> remarks_of(const geometry::SculptSolution& solution, const Demands& demands,
                             const SculptShape& shape, double diagonal_m, const Conflicts& conflicts);
/// Says what concerns the icon worked on, is new, or has become worse; keeps in the shape what was said.
void note_icons(std::vector<Told> told, SculptShape& shape, std::string_view worked_on,
                std::vector<std::string>& notes);
/// Loads on what sides, regions or other icons hold: they push at nothing.
void note_held_loads(const SculptShape& shape, std::vector<std::string>& notes);

}  // namespace handloft::model
