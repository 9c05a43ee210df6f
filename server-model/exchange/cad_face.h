#pragma once
// A face of a CAD model on a B-spline surface, as plain values: what the CAD importer finds and the exporters
// write. Metres, world.

#include <string>
#include <vector>

#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/knot_vector.h"
#include "server-model/geometry/types.h"

namespace handloft::exchange {

/// A rational B-spline in the parameter plane of a surface.
struct TrimCurve {
  geometry::KnotVector knots;  ///< Open, clamped.
  std::vector<geometry::Vec2> control;
  std::vector<double> weights;  ///< Empty: all 1.
};

/// Closed loops, the outer one first: each curve begins where the one before ends, but for gaps as small as
/// files have them; the face lies on their left. They may stand out of the parameters' range by as much as
/// files let them (up to a thousandth of it). A side of a closed surface where the face meets itself
/// stands in them twice, a period apart; a pole is a curve whose image is one point.
using TrimLoops = std::vector<std::vector<TrimCurve>>;

struct CadFace {
  std::string name;  ///< UTF-8; as the file has it, often empty.
  geometry::BSplineSurface surface;
  TrimLoops loops;        ///< Empty: the whole parameter rectangle.
  bool reversed = false;  ///< Its outside is against du x dv.
};

}  // namespace handloft::exchange
