#pragma once
// The degree of a surface chosen from its points (A4; the paper leaves N to the user), by the cross-validated
// residual: each point's distance from the surface that all the others would give. For least squares no such
// surface needs to be fitted: with h_i the leverage of point i (the diagonal of the hat matrix Q Q^T), that
// distance is r_i / (1 - h_i) (Allen's PRESS, 1974). This leave-one-out form was taken and not k folds since
// it has no random partition, so it gives the same degree for the same points in any order, and since one QR
// of the highest degree serves all: the coefficients of a lower degree are a prefix, so row i of Q is one
// substitution, and partial sums along it are the leverages and residuals of every degree. Its weakness:
// points that were laid densely along one stroke predict each other too well.

#include <span>
#include <vector>

#include "server-model/geometry/polynomial_fit.h"

namespace handloft::geometry {

struct AutomaticDegreeOptions {
  int highest_degree = max_degree;  ///< The highest tried, 1..6.
  /// A higher degree must lower the cross-validated rms by this fraction of it: less is not worth the swings
  /// of a higher polynomial outside of the data. The paper found cubic or lower enough.
  double least_gain = 0.05;
  /// And the mean of the paired differences of squares over the points must be this many standard errors
  /// above 0; 2 is the usual level of 2.5 %.
  double least_significance = 2.0;
  /// An rms below this fraction of the footprint's larger half extent is rounding: no degree can gain there.
  double negligible_rms = 1e-10;
  double rank_threshold = 1e-10;  ///< As FitOptions.
};

/// What cross-validation says about one degree.
struct DegreeScore {
  enum class State {
    validated,
    /// The points don't carry it (A7): too few, or their footprint lies on a curve of this degree.
    rank_deficient,
    /// They carry it, but not without one of them, whose distance can't be predicted then.
    hangs_on_single_points,
  };
  int degree = 0;
  State state = State::rank_deficient;
  double weighted_rms = 0;         ///< Of the fit itself, metres; 0 if rank deficient.
  double cross_validated_rms = 0;  ///< sqrt(sum theta e^2 / sum theta), metres; 0 if not validated.
};

struct AutomaticFit {
  PolynomialFit fit;  ///< requested_degree is the chosen one.
  /// For degrees 1..highest_degree.
  std::vector<DegreeScore> scores;
  /// That of the chosen degree, metres; 0 where not even a plane could be validated.
  double cross_validated_rms = 0;
};

/// Fits with the lowest degree that no higher one betters significantly, among those that the points carry.
/// If not even a plane can be validated (3 points, or a fourth that alone spans the area), the plane is
/// taken. Errors: as fit_polynomial_surface(), and invalid_argument for options out of range.
Result<AutomaticFit> fit_automatic_degree(std::span<const WeightedPoint> local_points,
                                          const AutomaticDegreeOptions& options = {});

}  // namespace handloft::geometry
