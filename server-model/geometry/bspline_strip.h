#pragma once
// What the operations on B-spline curves and surfaces share: one direction at a time, a control "value" being
// as many numbers as the other direction and the homogeneous coordinates have. Not for others.

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_curve.h"
#include "server-model/geometry/bspline_refine.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/knot_vector.h"

namespace handloft::geometry::detail {

/// `width` numbers a control value: points of 3 numbers or, rational, 4 (w x, w y, w z, w), side by side.
struct Strip {
  KnotVector knots;
  std::size_t width = 0;
  std::size_t point_width = 3;
  std::vector<double> values;
};

Strip to_strip(const BSplineCurve& curve);
Strip to_strip(const BSplineSurface& surface, Direction direction);
BSplineCurve to_curve(Strip strip);
/// Back into a surface whose other direction is that of `like`.
BSplineSurface to_surface(const Strip& strip, Direction direction, const BSplineSurface& like);

/// Knots and control values without a kind: function i reaches from knots[i] to knots[i + degree + 1].
struct OpenStrip {
  int degree = 1;
  std::size_t width = 0;
  std::vector<double> knots;
  std::vector<double> values;

  std::size_t count() const { return knots.size() - static_cast<std::size_t>(degree) - 1; }
};

/// Knot `index` of the endless sequence of a periodic vector: its base period and exact images of it.
double endless_knot(const KnotVector& knots, long index);
/// A knot of the base period, k periods on.
double knot_image(const KnotVector& knots, double knot, long k);

/// An open strip as it is; of a periodic one, functions first .. last - 1 of its endless sequence.
OpenStrip unroll(const Strip& strip, long first, long last);
inline OpenStrip unroll(const Strip& strip) {
  return unroll(strip, 0, strip.knots.function_count());
}

/// Inserts `added` (ascending, inside the domain) all at once. Convex sums alone.
OpenStrip insert(const OpenStrip& strip, std::span<const double> added);

/// With each of `places` (ascending, different) a knot p times at least: a value then lies on the shape
/// there.
OpenStrip interpolated(const OpenStrip& strip, std::span<const double> places);

/// The clamped part over [from, to], both inside the domain.
OpenStrip segment(const OpenStrip& strip, double from, double to);

/// What a periodic strip becomes when `change` has worked on a stretch of its endless sequence that is long
/// enough, or an open one when it has worked on all of it: without the functions outside the domain.
/// `new_degree` is that of the result.
template <typename Change>
Result<Strip> through_open(const Strip& strip, int new_degree, const Change& change);

/// The functions of `raw` over the domain of `like`, as a strip of its kind.
Result<Strip> fold(const OpenStrip& raw, const Strip& like);

template <typename Change>
Result<Strip> through_open(const Strip& strip, int new_degree, const Change& change) {
  // A new function over the period must not feel the stretch's ends.
  const long margin = strip.knots.is_periodic() ? 2L * new_degree : 0;
  return fold(change(unroll(strip, -margin, strip.knots.function_count() + margin)), strip);
}

/// Numbers that a strip may hold: an operation that needs more is refused.
inline constexpr std::size_t max_strip_values = std::size_t{1} << 27;

}  // namespace handloft::geometry::detail
