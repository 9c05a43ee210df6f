#pragma once
// Mirror images in a plane (A12):  p' = p - 2 ((p - o) . n) n.

#include "common/base/result.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// A plane with a unit normal. Errors: invalid_argument for numbers that are not finite or a zero normal.
Result<Plane> make_plane(const Vec3& origin, const Vec3& normal);

/// Precondition: plane.normal has unit length.
Vec3 reflect_point(const Vec3& point, const Plane& plane);
Vec3 reflect_direction(const Vec3& direction, const Plane& plane);

/// The mirror image of a frame, right-handed again by turning its y axis: the surface over it is
/// PolynomialSurface::flipped_y() of the original.
Frame reflect_frame(const Frame& frame, const Plane& plane);

}  // namespace handloft::geometry
