#pragma once
// Fitted polynomial shapes as B-spline surfaces: the same points, exactly, in the other representation.

#include "common/base/result.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// One clamped patch without inner knots, of the polynomial's degree both ways, whose parameters are the
/// frame's x and y in metres: S(x, y) = surface.world_point(frame, x, y) over the box, to rounding. Errors:
/// invalid_argument for a box without area or with numbers that are not finite, as to_bezier_patch().
Result<BSplineSurface> to_bspline_surface(const PolynomialSurface& surface, const Frame& frame,
                                          const Box2& box);

}  // namespace handloft::geometry
