#pragma once
// B-splines through or near to given points (Piegl and Tiller, chapter 9), with the error stated: curves
// through rows of points, surfaces through grids of points, and surfaces near to points that lie anywhere,
// such as a mesh's vertices. Approximations get more knots where the error is until it is small enough.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_curve.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// How far the given points lie from the result, metres: from a point near the place at the point's own
/// parameters, found by Newton's method and never farther than that place.
struct FitError {
  double max_m = 0;
  double rms_m = 0;
};

struct BSplineFitOptions {
  int degree_u = 3;  ///< Of curves, too.
  int degree_v = 3;
  /// Refined until no point is farther: a tenth of what a hand can place.
  double tolerance_m = 1e-4;
  /// And no further than this; the paper's finest surface has 12,879.
  int max_control_points = 16'000;
  /// Points anywhere alone: how much bending counts beside them, of the points' own weight. So little that it
  /// shapes the surface only where no points lie (A6's fits have none).
  double smoothing = 1e-9;
  /// Points anywhere alone: knot spans to start with, in each direction.
  int first_spans_u = 1;
  int first_spans_v = 1;
  /// Points anywhere alone: after each solution the points' parameters move to their nearest places on it so
  /// often (Hoschek 1988), so that the error is a distance and not what the parameters were guessed to be.
  int parameter_corrections = 2;
};

struct CurveFit {
  BSplineCurve curve;
  FitError error;
  bool within_tolerance = false;
};

struct SurfaceFit {
  BSplineSurface surface;
  FitError error;
  bool within_tolerance = false;
};

/// 0 .. 1, proportional to the length of the polygon. Errors: invalid_argument for fewer than 2 points,
/// numbers that are not finite, points that are all one.
Result<std::vector<double>> chord_parameters(std::span<const Vec3> points);

/// The clamped curve through all points, which has as many control points: parameters by chord length, knots
/// by averaging (eq. 9.8). A point that repeats its predecessor is left out. Errors: invalid_argument for
/// fewer than degree + 1 points, numbers that are not finite.
Result<BSplineCurve> interpolate_curve(std::span<const Vec3> points, int degree);

/// A clamped curve near to the points, through the first and last (section 9.4.1), in parameters by chord
/// length or as given (ascending; knots span their range). Errors: invalid_argument as above and for options
/// out of range.
Result<CurveFit> approximate_curve(std::span<const Vec3> points, const BSplineFitOptions& options = {});
Result<CurveFit> approximate_curve(std::span<const Vec3> points, std::span<const double> parameters,
                                   const BSplineFitOptions& options = {});

/// The same curve in parameters that are its length from the start, metres, as far as options.tolerance_m
/// allows: not rational, clamped (a periodic one is cut at its lower end), corners where they were. The error
/// is that of places at equal lengths, so that it states the parameters' error, too. Errors: invalid_argument
/// for bad curves and such without a length.
Result<CurveFit> by_length(const BSplineCurve& curve, const BSplineFitOptions& options = {});

/// Points of a grid, rows x columns, row by row.
struct PointGrid {
  std::size_t rows = 0, columns = 0;
  std::span<const Vec3> points;
};

/// The clamped surface through all points (A9.4); u runs over the rows. Parameters: the mean chord lengths
/// of all columns and rows, in which those of one point (poles) do not count. Errors: invalid_argument for
/// sizes that do not fit, fewer than degree + 1 rows or columns, numbers that are not finite, two
/// neighbouring rows or columns that are the same.
Result<BSplineSurface> interpolate_grid(const PointGrid& grid, int degree_u, int degree_v);

/// A clamped surface near to the points, through the four corners (A9.7); its edges depend on the points of
/// the grid's edges alone. Errors: as above.
Result<SurfaceFit> approximate_grid(const PointGrid& grid, const BSplineFitOptions& options = {});

/// A point with its parameters and its weight (for a mesh the area around it).
struct SurfaceSample {
  Vec3 place = Vec3::Zero();
  Vec2 uv = Vec2::Zero();
  double weight = 1;
};

/// A clamped surface near to points anywhere, over the box of their parameters. Errors: invalid_argument
/// ("samples[3].uv") for no samples, numbers that are not finite, weights that are negative or all 0, samples
/// whose parameters have no area, options out of range.
Result<SurfaceFit> approximate_points(std::span<const SurfaceSample> samples,
                                      const BSplineFitOptions& options = {});

/// Samples with parameters by projection along the frame's normal: uv is x and y, metres.
std::vector<SurfaceSample> projected_on(const Frame& frame, std::span<const Vec3> places);
/// Or those of the nearest places on a surface that is close. Errors: as SurfaceProjector says.
Result<std::vector<SurfaceSample>> projected_on(const BSplineSurface& base, std::span<const Vec3> places);

/// Weights a patch's vertices by a third of the triangles around each, so that fine meshing does not count
/// more. Errors: invalid_argument for indices out of range or not three a triangle, sizes that differ.
Status weigh_by_area(std::span<const std::uint32_t> indices, std::span<SurfaceSample> vertices);

}  // namespace handloft::geometry
