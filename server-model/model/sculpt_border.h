#pragma once
// What a region constraint holds (D11), and the knots that make it end where it was picked.

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/sculpt_rows.h"
#include "server-model/model/limits.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

enum class RegionHold : std::uint8_t {
  points,  ///< The control points over it, which hold nothing else: it ends at knots.
  places,  ///< Places all over it: there are no knots at its border.
  spring,  ///< Places all over it are pulled to where they are to be: it has a stiffness.
};
/// Of a region constraint. Regions that hold their outside have no use for it.
RegionHold region_hold(const SculptIcon& icon, const geometry::BSplineSurface& rest);

/// The parameters of a region icon.
geometry::UvRectangle region_of(const SculptIcon& icon);

/// Knots for a region constraint that is about to act: inserted into the surface at rest and under its icons,
/// neither of which moves, with the icon's corners moved onto knots that are near. A region whose outside is
/// held gets such inside too, so that something may move; before it the present shape is committed.
/// Constraints that lie over the former knots (curves, regions) begin anew: where they are is where they are
/// to be. Where there would be spans too short or control points too many, nothing changes, which a note
/// says. Other icons: nothing to do.
Status fit_border(SculptShape& shape, SculptIcon& icon, std::string_view field, const Limits& limits,
                  std::vector<std::string>& notes);

}  // namespace handloft::model
