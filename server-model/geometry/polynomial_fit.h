#pragma once
// Weighted least squares fit of a polynomial surface (A6, eq. 3):  min sum_i theta_i (f(x_i, y_i) - z_i)^2,
// theta_i the pressure of point i, z along the base plane's normal. Solved by Householder QR of the rows
// sqrt(theta_i) * (monomials in centred, box-scaled variables), in blocks (RowQr), never by normal equations:
// those lose every digit on NIST's Filip. Rank (A7) is judged on R by column-pivoted QR.
//
// fit_polynomial_surface() for one use; PolynomialFitter (polynomial_fitter.h) for live points;
// fit_automatic_degree() (automatic_degree.h) where the degree is open.

#include <cstddef>
#include <span>

#include "common/base/result.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

struct FitOptions {
  int degree = 2;  ///< Wanted total degree, 1..6; the paper found cubic or lower enough.
  /// Pivots below this fraction of the largest count as zero (A7): 1e-10 leaves six digits to a fit that is
  /// accepted, with scaled columns.
  double rank_threshold = 1e-10;
};

/// How far the points lie from the surface, along the frame's normal, metres. Over all points given.
struct ResidualStatistics {
  std::size_t count = 0;
  double rms = 0;           ///< sqrt(sum r^2 / n)
  double weighted_rms = 0;  ///< sqrt(sum theta r^2 / sum theta)
  double max = 0;           ///< max |r|
};

struct PolynomialFit {
  PolynomialSurface surface;
  /// What was asked for. Less than that in surface.degree() says that the points carried no more (A7).
  int requested_degree = 0;
  ResidualStatistics statistics;

  bool degree_reduced() const { return surface.degree() < requested_degree; }
};

/// Fits points given in the local frame. Points of weight 0 don't pull, but are counted in the statistics.
/// Errors: invalid_argument ("points[3].position", "points[3].weight") for numbers that are not finite or a
/// negative weight, or a degree outside 1..6; rank_deficient if not even a plane is determined: fewer than 3
/// weighted points, or all on one line in the footprint.
Result<PolynomialFit> fit_polynomial_surface(std::span<const WeightedPoint> local_points,
                                             const FitOptions& options = {});

/// The same for world points in `frame`.
Result<PolynomialFit> fit_polynomial_surface(std::span<const WeightedPoint> world_points, const Frame& frame,
                                             const FitOptions& options = {});

/// Statistics of local points against any surface.
ResidualStatistics residual_statistics(const PolynomialSurface& surface,
                                       std::span<const WeightedPoint> local_points);

}  // namespace handloft::geometry
