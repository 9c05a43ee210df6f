#pragma once
// Other control points for the same B-spline: knots inserted and removed, degrees raised, curves and surfaces
// split, periodic ones cut open (Piegl and Tiller, chapter 5), parameters scaled to chord length.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_curve.h"
#include "server-model/geometry/bspline_surface.h"

namespace handloft::geometry {

enum class Direction : std::uint8_t { u, v };

/// The same shape with more knots (each as often as listed; ascending not needed). Errors: invalid_argument
/// for knots outside the domain, or that would stand more than p times (p + 1 at the ends of open ones; what
/// an end then has outside the domain falls away). All here: resource_exhausted for sizes without measure.
Result<BSplineCurve> insert_knots(const BSplineCurve& curve, std::span<const double> knots);
Result<BSplineSurface> insert_knots(const BSplineSurface& surface, Direction direction,
                                    std::span<const double> knots);

/// One occurrence of a knot less, if the shape moves by no more than `tolerance` (metres). Errors:
/// failed_precondition when it would (the bound is safe: a shape that moves less may be refused too), and for
/// periods of fewer than p + 2 control values; invalid_argument when it is no inner knot.
Result<BSplineCurve> remove_knot(const BSplineCurve& curve, double knot, double tolerance_m);
Result<BSplineSurface> remove_knot(const BSplineSurface& surface, Direction direction, double knot,
                                   double tolerance_m);

/// The same shape with a degree higher by `by` >= 1, continuity kept (each knot stands `by` times more).
Result<BSplineCurve> elevate_degree(const BSplineCurve& curve, int by);
Result<BSplineSurface> elevate_degree(const BSplineSurface& surface, Direction direction, int by);

/// Two clamped parts that meet at the parameter, with the same control points there to the bit; a periodic
/// one is cut open there into one. Errors: invalid_argument for a parameter at or outside the ends of an open
/// one.
Result<std::vector<BSplineCurve>> split(const BSplineCurve& curve, double parameter);
Result<std::vector<BSplineSurface>> split(const BSplineSurface& surface, Direction direction,
                                          double parameter);

/// As an open, clamped one: of a periodic one, cut at its lower end.
BSplineCurve clamped(const BSplineCurve& curve);
BSplineSurface clamped(const BSplineSurface& surface);

/// Bezier pieces, one a pair of spans, u by u; each keeps its parameters. Precondition here and below:
/// check(surface).
std::vector<BSplineSurface> bezier_patches(const BSplineSurface& surface);

/// Each direction's domain scaled to the mean length of its rows of control points (metres from 0): the same
/// shape, in parameters in which energies mean the same in both directions (D2).
BSplineSurface scaled_domain(const BSplineSurface& surface);
/// The mean length of the control polygon's rows along a direction, metres.
double mean_row_length(const BSplineSurface& surface, Direction direction);

}  // namespace handloft::geometry
