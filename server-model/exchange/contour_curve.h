#pragma once
// The half-opaque contour of a superellipse as C1 cubic splines, in the parameter plane and in space with the
// same parameter: the boundary that a trimmed CAD face needs (A26). Pieces are cubic Hermite segments with
// exact points and tangents, split until both curves are within tolerance. Not for others than step_writer.
//
// Below the exponent 1 the contour is a star whose four tips are cusps of no width: at 0.2 the outer third of
// a hand-sized arm is thinner than 10 micrometres, and towards its end both sides coincide within any CAD
// system's tolerance. An arm therefore ends where it gets thinner than `min_tip_width_m`, in a straight edge
// across. What is left of the contour is unchanged; what is left out is nowhere wider than that.

#include <vector>

#include "server-model/exchange/surface_export.h"

namespace handloft::exchange::detail {

/// C1 cubic in B-spline form: end knots of multiplicity 4, inner knots of multiplicity 2.
template <typename Point>
struct CubicSpline {
  std::vector<double> knots;  ///< Distinct, rising.
  std::vector<Point> poles;   ///< 2 * knots.size() of them.
};

/// A part of the boundary, counterclockwise, over one common parameter.
struct ContourArc {
  CubicSpline<geometry::Vec2> plane;  ///< In the frame's x-y plane, metres.
  CubicSpline<geometry::Vec3> space;  ///< World, metres.
};

struct ContourTolerance {
  double plane_m = 1e-8;  ///< From the superellipse.
  double space_m = 1e-8;  ///< Of the curve in space from the surface point at the same parameter.
};

/// Where the arms of a star end: 10 micrometres is below what machines that make the parts can hold, and 100
/// times the 1e-7 m within which CAD systems take two points for one.
inline constexpr double min_tip_width_m = 1e-5;

/// Counterclockwise, closed: the end of each arc is the begin of the next. Four arcs from tip to tip,
/// starting at +x; for an exponent below 1 each is followed by the straight end of its tip, eight in all.
std::vector<ContourArc> contour_arcs(const SurfaceExport& item, double level,
                                     const ContourTolerance& tolerance);

/// Half extents of the box around those arcs: less than the contour's where tips are cut.
geometry::Vec2 boundary_half_extent(const geometry::Superellipse& superellipse, double level);

}  // namespace handloft::exchange::detail
