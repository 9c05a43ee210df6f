#pragma once
// The half-opaque contour of a superellipse as C1 cubic splines, in the parameter plane and in space with the
// same parameter: the boundary that a trimmed CAD face needs (A26). Pieces are cubic Hermite segments with
// exact points and tangents, split until both curves are within tolerance. Not for others than step_writer.

#include <array>
#include <vector>

#include "server-model/exchange/surface_export.h"

namespace handloft::exchange::detail {

/// C1 cubic in B-spline form: end knots of multiplicity 4, inner knots of multiplicity 2.
template <typename Point>
struct CubicSpline {
  std::vector<double> knots;  ///< Distinct, rising.
  std::vector<Point> poles;   ///< 2 * knots.size() of them.
};

/// One quarter of the contour, counterclockwise, over one common parameter.
struct ContourArc {
  CubicSpline<geometry::Vec2> plane;  ///< In the frame's x-y plane, metres.
  CubicSpline<geometry::Vec3> space;  ///< World, metres.
};

struct ContourTolerance {
  double plane_m = 1e-8;  ///< From the superellipse.
  double space_m = 1e-8;  ///< Of the curve in space from the surface point at the same parameter.
};

/// Four arcs from tip to tip, starting at +x.
std::array<ContourArc, 4> contour_arcs(const SurfaceExport& item, double level,
                                       const ContourTolerance& tolerance);

}  // namespace handloft::exchange::detail
