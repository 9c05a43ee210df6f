#pragma once
// Residual matching (A8): when a surface f0 becomes f1 by a tool, its points follow so that a refit gives f1
// again. r_i = z_i - f0(x_i, y_i);  z_i' = f1(x_i, y_i) + r_i;  x_i, y_i and theta_i unchanged.
// Exact under the conditions of A8: same frame, same footprint positions, same weights, f1 in the same space,
// and f0 the current optimum (a point edited since the fit breaks it: refit first, A9).

#include <span>
#include <vector>

#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// r_i along the frame's z axis, metres; points in the local frame.
std::vector<double> vertical_residuals(const PolynomialSurface& surface,
                                       std::span<const WeightedPoint> local_points);

/// Moves the points in z onto `surface` plus their residual. Precondition: equal sizes.
void match_residuals(const PolynomialSurface& surface, std::span<const double> residuals,
                     std::span<WeightedPoint> local_points);

/// Both steps for world points in a frame: what an edit f0 -> f1 does to them.
std::vector<WeightedPoint> follow_surface(std::span<const WeightedPoint> world_points, const Frame& frame,
                                          const PolynomialSurface& before, const PolynomialSurface& after);

}  // namespace handloft::geometry
