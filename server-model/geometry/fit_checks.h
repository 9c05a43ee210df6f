#pragma once
// What the fitting functions share: checks of their input and the box of the scaled variables. Not for
// others.

#include <cstddef>
#include <span>
#include <string>

#include "common/base/result.h"
#include "server-model/geometry/polynomial_fit.h"

namespace handloft::geometry::detail {

/// Errors: invalid_argument as fit_polynomial_surface() says.
Status check_fit_options(const FitOptions& options);
/// `field` names the point in the error, such as "points[3]".
Status check_point(const WeightedPoint& point, const std::string& field);
Status check_points(std::span<const WeightedPoint> points);

/// The footprint's box with sides that are safe to divide by.
Box2 scaling_box(std::span<const WeightedPoint> local_points);

/// Writes sqrt(theta) * (monomials(u, v) | z) of a point: coefficient_count(degree) + 1 numbers, `stride`
/// apart.
void weighted_row(const WeightedPoint& local_point, const Box2& box, int degree, double* row,
                  std::ptrdiff_t stride);

/// Solves for the largest degree of full rank, from `degree` down (A7). Errors: rank_deficient;
/// invalid_argument if the numbers overflow.
Result<PolynomialFit> solve_for_largest_degree(const RowQr& qr, const Box2& box, const FitOptions& options,
                                               std::size_t point_count);

}  // namespace handloft::geometry::detail
