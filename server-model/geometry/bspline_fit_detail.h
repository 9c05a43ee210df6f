#pragma once
// What fitting curves, grids and points anywhere share. Not for others.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_fit.h"
#include "server-model/geometry/knot_vector.h"

namespace handloft::geometry::detail {

/// One row a datum; curves have 3 columns, surfaces 3 a point of the other direction.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Errors: invalid_argument, naming "options....".
Status check_options(const BSplineFitOptions& options);
/// Errors: invalid_argument ("points[3]").
Status check_points(std::span<const Vec3> points, const char* field);

/// Clamped knots under which as many functions as parameters interpolate (eq. 9.8).
Result<KnotVector> averaged_knots(std::span<const double> parameters, int degree);
/// Clamped, from `lower` to `upper`, with these inner knots (ascending).
Result<KnotVector> clamped_knots(int degree, double lower, double upper, std::span<const double> inner);
/// The inner knots.
std::vector<double> inner_knots(const KnotVector& knots);

/// Control rows through all data. Errors: invalid_argument when they have no solution.
Result<Rows> interpolate_rows(const KnotVector& knots, std::span<const double> parameters, const Rows& data);
/// Control rows nearest to the data, through the first and last row; each span must hold a parameter (then
/// the sums have full rank). As many functions as data: interpolated.
Result<Rows> approximate_rows(const KnotVector& knots, std::span<const double> parameters, const Rows& data);

/// Knots with those spans halved (in the middle of their parameters) that `wanted` names, as long as each
/// half keeps a parameter and no more than `max_count` functions come about: the worst first. wanted[s] is a
/// span's error, 0: leave it. Ascending parameters. Nothing when none can be.
std::vector<double> halved_inner_knots(const KnotVector& knots, std::span<const double> parameters,
                                       std::span<const double> wanted, int max_count);

/// The distance to a place near the one at `u`, and its parameter there: Newton's method for the foot point,
/// kept when it comes nearer.
double distance_near(const BSplineCurve& curve, const Vec3& place, double& u);
double distance_near(const BSplineSurface& surface, const Vec3& place, Vec2& uv);

}  // namespace handloft::geometry::detail
