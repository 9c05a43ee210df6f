#pragma once
// Constraints and loads on a sculpted surface or curve as rows and right-hand sides (requirements D5 to D12,
// D15): what icons do, in terms of control points. Parameters are the surface's own; targets are of the whole
// surface in both modes, not of displacements.

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_curve.h"
#include "server-model/geometry/bspline_surface.h"

namespace handloft::geometry {

/// Demands  phi(x) = target,  or with `along`  along . phi(x) = along . target.
struct SculptRow {
  SurfaceFunctional functional;
  Vec3 target = Vec3::Zero();
  std::optional<Vec3> along;  ///< Any length but 0.
  /// How far off, in the functional's unit (metres, or metres a parameter), it may be before that is a
  /// conflict. 0: as rounding makes. Those with one are soft: a curve has more places than a surface can
  /// meet, and what its control points can hardly do would be bought with huge waves elsewhere. See
  /// SculptSystem.
  double tolerance = 0;
  /// Held by a spring, not exactly (D11's penalty): it gives way by so much under a unit of force.
  double yield = 0;
};

/// Adds phi * force to the right-hand side: to a point's functional a force, to a derivative's a couple.
struct SculptLoad {
  SurfaceFunctional functional;
  Vec3 force = Vec3::Zero();
};

/// What of a point an icon holds (D6, D7), with the paper's labels for the icons.
enum class PointAspect {
  position,
  tangent_u,  ///< w_u, "R"
  tangent_v,  ///< w_v, "V"
  second_u,   ///< w_uu, "R2"
  second_v,   ///< w_vv, "V2"
  twist,      ///< w_uv, "RV"
};
/// Errors of all below: invalid_argument for numbers that are not finite.
Result<SculptRow> point_row(const BSplineSurface& rest, const Vec2& uv, PointAspect aspect,
                            const Vec3& target);
/// D8: N . w_u = 0 and N . w_v = 0. Errors: also for a normal of no length.
Result<std::array<SculptRow, 2>> normal_rows(const BSplineSurface& rest, const Vec2& uv, const Vec3& normal);

/// The derivative of order a, 0..2, of a curve at u (point[] are its control points).
Result<SurfaceFunctional> curve_functional(const BSplineCurve& curve, double u, int a);
/// Of a curve: position (0), tangent (1) or second derivative (2).
Result<SculptRow> curve_point_row(const BSplineCurve& rest, double u, int derivative, const Vec3& target);

/// A place on a curve in the parameter plane: t runs 0..1 by the length of the polyline there.
struct CurvePlace {
  double t = 0;
  Vec2 uv = Vec2::Zero();
  double weight_m = 0;  ///< Arc length on the rest surface (or area, m^2) that it stands for.
};
inline constexpr std::size_t max_curve_places = 4096;
/// D9: the polyline (>= 2 corners) is cut at its corners and wherever it crosses a knot; every piece gets
/// p + 1 Gauss places (p: the degree of the direction it runs along, the larger one when oblique), so that a
/// piece along a parameter line is met everywhere when met there. Ends are included. In closed directions the
/// polyline may run on beyond the seam, max_turns at most. Errors: invalid_argument for corners outside the
/// domain, one place only; resource_exhausted above max_curve_places.
inline constexpr double max_turns = 64;
Result<std::vector<CurvePlace>> collocation_places(const BSplineSurface& rest,
                                                   std::span<const Vec2> polyline);
/// w(u(t), v(t)) = target at each place. `tolerance_m`: how far a curve that the surface has not enough
/// control points for may be off.
Result<std::vector<SculptRow>> curve_rows(const BSplineSurface& rest, std::span<const CurvePlace> places,
                                          std::span<const Vec3> targets, double tolerance_m);

struct UvRectangle {
  Vec2 lower = Vec2::Zero(), upper = Vec2::Zero();
};
/// The control points that have a say in the rectangle, ascending, and those that have one outside it.
/// Rectangles of closed directions may reach across the seam, over a period at most (region_border.h).
Result<std::vector<std::uint32_t>> points_over(const BSplineSurface& rest, const UvRectangle& region);
Result<std::vector<std::uint32_t>> points_outside(const BSplineSurface& rest, const UvRectangle& region);
/// D11: the region keeps its shape and moves as a body: every control point that has a say in it. What is
/// held thus ends at the next knot; for a border elsewhere insert knots there first (region_border.h). For
/// deformation inside a region, hold points_outside() (SculptSetup::held).
Result<std::vector<SculptRow>> region_rows(const BSplineSurface& rest, const UvRectangle& region,
                                           const Eigen::Isometry3d& motion);
/// The same for a region of any new shape: targets in the order of points_over().
Result<std::vector<SculptRow>> region_rows(const BSplineSurface& rest, const UvRectangle& region,
                                           std::span<const Vec3> targets);

/// D11 as a penalty: the region is pulled towards the targets, one a place of area_quadrature(), as by
/// springs all over it: energy k / 2 of the mean |w - target|^2, k in N/m of all together. As k grows it is
/// met.
Result<std::vector<SculptRow>> spring_rows(const BSplineSurface& rest, std::span<const CurvePlace> places,
                                           std::span<const Vec3> targets, double stiffness);

/// D5: a force at a point.
Result<SculptLoad> point_load(const BSplineSurface& rest, const Vec2& uv, const Vec3& force);
/// D15: a moment (N m, world) about the point, as forces on the derivatives such that their work is that of
/// the moment for every small rotation of the tangents: M_t tangential, M_n normal part,
///   f_u = (M_t + M_n / 2) x w^u,  f_v = (M_t + M_n / 2) x w^v,  w^u, w^v the reciprocal tangents.
/// Errors: failed_precondition where the tangents are parallel or vanish.
Result<std::array<SculptLoad, 2>> moment_loads(const BSplineSurface& rest, const Vec2& uv,
                                               const Vec3& moment);

/// D10, D12: Gauss places along a polyline and over a rectangle, with the lengths and areas they stand for.
Result<std::vector<CurvePlace>> line_quadrature(const BSplineSurface& rest, std::span<const Vec2> polyline);
Result<std::vector<CurvePlace>> area_quadrature(const BSplineSurface& rest, const UvRectangle& region);
/// D10, D12: f = k (c - c'), spread evenly over the places, where c' is the curve or region at rest and c the
/// same moved as a body: four loads whose functionals do not depend on the motion. `stiffness` is of all
/// together (N/m): pushed along, it is a spring as that of a point.
Result<std::vector<SculptLoad>> motion_loads(const BSplineSurface& rest, std::span<const CurvePlace> places,
                                             const Eigen::Isometry3d& motion, double stiffness);

}  // namespace handloft::geometry
