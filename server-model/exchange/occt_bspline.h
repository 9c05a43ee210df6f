#pragma once
// B-splines of Open CASCADE and ours, into each other: knots with their multiplicities there, each as often
// as it stands here. Not for others than cad_*.

#include <Geom2d_BSplineCurve.hxx>
#include <Geom2d_Curve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_Surface.hxx>

#include "common/base/result.h"
#include "server-model/exchange/cad_face.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::exchange::detail {

/// From a model's coordinates into the world: p' = metres_per_unit p + translation.
struct CadPlacement {
  double metres_per_unit = 0.001;
  geometry::Vec3 translation = geometry::Vec3::Zero();
};

/// The surface as a B-spline: itself, a Bezier surface's, or what a trimmed surface was cut from (parameters
/// stay). Null for all other kinds.
Handle(Geom_BSplineSurface) bspline_of(const Handle(Geom_Surface) & surface);

/// Exactly, in the world. The library's periodic surface has its first control point in the first span of the
/// period, as ours has: knots and control points go over as they are; one that our knot vector refuses is cut
/// open. Errors: as KnotVector, check() (a degree of 25, weights that are not positive).
Result<geometry::BSplineSurface> to_geometry(const Handle(Geom_BSplineSurface) & surface,
                                             const CadPlacement& placement);

/// The other way. Throws the library's exceptions. Errors: as check().
Result<Handle(Geom_BSplineSurface)> to_occt(const geometry::BSplineSurface& surface,
                                            const CadPlacement& placement);

/// Stretches the domain to the bounds.
void set_domain(Handle(Geom_BSplineSurface) & surface, double u0, double u1, double v0, double v1);

/// A piece of a curve in a parameter plane, as the edge runs through it. Lines stay lines. Errors:
/// data_corrupt.
enum class Sense { forward, reversed };
Result<TrimCurve> to_trim(const Handle(Geom2d_Curve) & curve, double first, double last, Sense sense);
/// Errors: invalid_argument (counts that do not fit, numbers that are not finite, weights).
Result<Handle(Geom2d_BSplineCurve)> to_occt(const TrimCurve& curve);

}  // namespace handloft::exchange::detail
