#pragma once
// Profile modification (A19): a surface takes the shape of curves drawn over it, and its points follow.
// Temporary points along the curves, as many as the original ones in total and of full certainty, join the
// fit; the surface f1 that comes out stays, the temporaries go, and the originals keep their residuals
// (residual_matching.h), so that a fit of them alone gives f1 again (A8). Frame and polynomial space are
// those of the present fit throughout.
//
// All in the local frame of the surface, metres. Order and direction of strokes change no bit of any result.

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/curve_smoothing.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/row_qr.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

using Curve = std::vector<Vec3>;

/// The strokes smoothed (A18), each turned and all sorted by a rule that looks at their points alone, so that
/// it doesn't matter how they were drawn. Those of fewer points than the window stay as they are; those
/// without points vanish. Errors: invalid_argument
/// ("strokes[2].points[3]", or as smooth_curve() for the options).
Result<std::vector<Curve>> prepare_strokes(std::span<const Curve> strokes,
                                           const SmoothingOptions& smoothing = {});

/// `total` shared out by length: largest remainders, at least one each where there are enough. All equal when
/// none has a length. The sum is `total`, unless there are no curves.
std::vector<std::size_t> share_by_length(std::span<const Curve> curves, std::size_t total);

/// `total` points, evenly spaced along each of the prepared strokes, shared out by length. Errors:
/// invalid_argument as resample_evenly().
Result<std::vector<Vec3>> points_along(std::span<const Curve> curves, std::size_t total);

/// Fits curves together with a shape's points, again and again while a curve is being drawn: the points are
/// factored once. A value; reading from several threads is fine.
class ProfileFitter {
 public:
  struct Options {
    double curve_weight = 1.0;  ///< rho of the temporary points: drawn with full certainty (A19).
    /// How far `current` may be from the optimum of the points, as a fraction of their heights: A8's
    /// tolerance.
    double optimum_tolerance = 1e-9;
    double rank_threshold = 1e-10;  ///< As FitOptions.
  };

  /// `current` must be the optimum of `local_points` in its own space. O(n p^2). Errors: invalid_argument for
  /// bad points; failed_precondition when points were changed since the fit: refit first (A9); rank_deficient
  /// when the points do not determine the surface's space.
  static Result<ProfileFitter> create(std::span<const WeightedPoint> local_points,
                                      const PolynomialSurface& current, const Options& options);
  static Result<ProfileFitter> create(std::span<const WeightedPoint> local_points,
                                      const PolynomialSurface& current) {
    return create(local_points, current, Options{});
  }

  /// f1, of the same degree and over the same box as `current`; without points, `current`. O(m p^2) for m
  /// points, which may lie anywhere. Errors: invalid_argument ("curve_points[3].position"), also when they
  /// lie so far away that numbers overflow.
  Result<PolynomialSurface> fit_with(std::span<const Vec3> curve_points) const;

  const PolynomialSurface& current() const { return current_; }

 private:
  ProfileFitter(PolynomialSurface current, RowQr qr, const Options& options);

  PolynomialSurface current_;
  RowQr qr_;
  Options options_;
};

/// How many points of a kept curve join a shape of n points (A20): a tenth, at least 1.
std::size_t kept_point_count(std::size_t n);

/// Points of the prepared strokes that are kept (A20): projected onto the surface along the frame's z, evenly
/// spaced there, shared out by length. Their residuals are 0 to rounding. Errors: as points_along().
Result<std::vector<Curve>> curves_on_surface(const PolynomialSurface& surface, std::span<const Curve> curves,
                                             std::size_t total);

/// The weight of kept points (A20): the mean of all originals. 0 for none.
double mean_weight(std::span<const WeightedPoint> points);

}  // namespace handloft::geometry
