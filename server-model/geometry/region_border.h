#pragma once
// Regions of a surface's parameters, two corners each (D11): across the seams of closed surfaces, and with
// the knots at their border that make what a region holds end there. Beside it, what both regions and curves
// need across seams. A region's lower corner is in the domain; where a direction is closed the upper one may
// lie beyond the seam, by less than a period.

#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/sculpt_rows.h"

namespace handloft::geometry {

/// Parameters nearer than this part of the domain are one.
inline constexpr double same_parameter = 1e-10;

/// Of two opposite corners: cut off at the ends of open directions, brought to the domain by whole periods of
/// closed ones. A period or more is all of that direction. Errors: invalid_argument for numbers that are not
/// finite, or no extent.
Result<UvRectangle> region_of(const BSplineSurface& rest, const Vec2& one, const Vec2& other);

/// A picked place says nothing about the turns of closed directions: each place is taken where it is nearest
/// to the one before.
std::vector<Vec2> without_jumps(const BSplineSurface& rest, std::span<const Vec2> places);

/// Whether the region ends at knots on all its sides, so that the control points over it hold it alone.
bool on_knots(const BSplineSurface& rest, const UvRectangle& region);

/// Knots for a region's border.
struct RegionBorder {
  UvRectangle region;        ///< With the sides that are near a knot moved onto it.
  std::vector<double> u, v;  ///< To be inserted (bspline_refine.h), in the domain.
  bool is_sliver = false;    ///< Narrower than a span may be: no knots are given, the region stays.
  std::size_t control_u = 0, control_v = 0;  ///< Then so many control points.
};
/// A side is moved onto a knot within 1/50 of the mean span, or what spans are not measured below
/// (sculpt_setup.cpp). `inner_spans` of each direction at least are in the region, by further knots between,
/// as far as they would be no slivers; 0: as many as there are. Errors: of a region that is none.
Result<RegionBorder> region_border(const BSplineSurface& rest, const UvRectangle& region, int inner_spans);

/// Places that tell the surface over the region: in each of its spans as many as the degrees have
/// coefficients, evenly spaced with the ends (the Greville places of the piece alone). Errors: as above;
/// resource_exhausted above max_curve_places.
Result<std::vector<CurvePlace>> region_places(const BSplineSurface& rest, const UvRectangle& region);

/// The knots strictly between two parameters, ascending, each once, images beyond the seam of closed
/// directions among them; more than `most` are not looked for.
std::vector<double> knots_between(const KnotVector& knots, double lower, double upper, std::size_t most);

}  // namespace handloft::geometry
