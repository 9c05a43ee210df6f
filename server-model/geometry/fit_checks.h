#pragma once
// What the fitting functions share: checks of their input and the box of the scaled variables. Not for
// others.

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include "common/base/result.h"
#include "server-model/geometry/design_block.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/row_qr.h"

namespace handloft::geometry::detail {

/// Beyond this a coordinate is no length of anything that a hand shapes, and its square nears overflow.
inline constexpr double max_coordinate_m = 1e100;

/// Errors: invalid_argument as fit_polynomial_surface() says.
Status check_fit_options(const FitOptions& options);
/// Comparisons with NaN are false.
inline bool is_good(const WeightedPoint& point) {
  return std::abs(point.position.x()) <= max_coordinate_m &&
         std::abs(point.position.y()) <= max_coordinate_m &&
         std::abs(point.position.z()) <= max_coordinate_m && point.weight >= 0 &&
         point.weight <= std::numeric_limits<double>::max();
}
/// `field` names the point in the error, such as "points[3]".
Status check_point(const WeightedPoint& point, const std::string& field);
Status check_points(std::span<const WeightedPoint> points);

/// A side shorter than this is rounding, not an extent; `box` is that of the points.
double extent_noise(const Box2& box, int axis);
/// The footprint's box with sides that are safe to divide by.
Box2 usable_box(const Box2& footprint);

/// Appends the rows of the points to `qr` (coefficient_count(degree) columns).
void append_points(const ScaledPoints& points, int degree, double weight_factor, RowQr& qr);
/// Residuals of the points that were scaled to the surface's own box.
ResidualStatistics statistics_of(const PolynomialSurface& surface, const ScaledPoints& points);

/// Writes sqrt(theta) * (monomials(u, v) | z) of a point: coefficient_count(degree) + 1 numbers, `stride`
/// apart.
void weighted_row(const WeightedPoint& local_point, const Box2& box, int degree, double* row,
                  std::ptrdiff_t stride = 1);

/// Solves for the largest degree of full rank, from `degree` down (A7). Errors: rank_deficient;
/// invalid_argument if the numbers overflow.
Result<PolynomialFit> solve_for_largest_degree(const RowQr& qr, const Box2& box, const FitOptions& options,
                                               std::size_t point_count);

}  // namespace handloft::geometry::detail
