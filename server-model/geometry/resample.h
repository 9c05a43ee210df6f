#pragma once
// Lengths of curves given by points, and points at even distances along them (A18: a stroke is dense where
// the hand was slow, and would weigh more there).

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// Length of the polyline, metres; 0 for fewer than two points.
double curve_length(std::span<const Vec3> points);

/// `count` points evenly spaced by arc length along the polyline, its ends among them; count 1 is the middle.
/// A curve without length gives its point `count` times. Errors: invalid_argument ("points" when there is
/// none, "points[3]" for a coordinate that is not finite, or "points" for a length that overflows).
Result<std::vector<Vec3>> resample_evenly(std::span<const Vec3> points, std::size_t count);

/// The polyline cut at fractions of its length, one part more than fractions; neighbours share the cut. A
/// part keeps at least one point. Errors: invalid_argument as above; "fractions[1]" for one that is outside
/// 0..1 or smaller than the one before.
Result<std::vector<std::vector<Vec3>>> split_curve(std::span<const Vec3> points,
                                                   std::span<const double> fractions);

}  // namespace handloft::geometry
