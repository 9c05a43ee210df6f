#pragma once
// Where rays and hands meet the visible part of a surface (A22-A24): places of opacity 1/2 or more only, so
// that nothing unseen is ever touched.

#include <optional>

#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/trim_field.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

struct SurfacePlace {
  Vec2 xy = Vec2::Zero();        ///< In the frame, metres.
  Vec3 position = Vec3::Zero();  ///< World.
  Vec3 normal = Vec3::UnitZ();   ///< World, unit, on the side of the frame's z.
  double distance_m = 0;         ///< Along the ray, or from the position asked for.
};

/// The first solid place of the surface along the ray {origin + t direction, t >= 0}, world. Along a line a
/// polynomial surface is a polynomial in t: all its roots over the trim's box are isolated by the variation
/// diminishing property of its Bernstein form, so that none is missed, grazing ones within rounding included.
/// Nothing when there is none or an input is not finite or the direction is zero.
std::optional<SurfacePlace> pick_surface(const PolynomialSurface& surface, const Frame& frame,
                                         const TrimField& trim, const Vec3& origin, const Vec3& direction);

struct NearestOptions {
  /// Starting places a side of the trim's box; a polynomial of degree 6 has few bumps over it.
  int samples_per_side = 17;
  int starts = 4;                 ///< Best of them, from which Newton's method descends.
  int outline_per_quadrant = 64;  ///< Of a superellipse's contour, for surfaces whose foot lies outside.
};

/// The solid place nearest to a position (world): the interior minimum by Newton's method to rounding, or the
/// nearest place on the contour. Nothing when an input is not finite or nothing is solid.
std::optional<SurfacePlace> nearest_solid_place(const PolynomialSurface& surface, const Frame& frame,
                                                const TrimField& trim, const Vec3& position,
                                                const NearestOptions& options = {});

}  // namespace handloft::geometry
