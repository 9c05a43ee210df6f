#pragma once
// Smoothing of freehand curves by Savitzky and Golay (Anal. Chem. 36, 1964; requirement A18): every sample is
// replaced by the value, at its place, of the polynomial of `order` that fits the `window` samples about it
// best; per coordinate, over the index. The paper of the dual representation names the filter but neither
// window nor order.

#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

inline constexpr int max_smoothing_window = 255;  ///< Some 2 s of a 120 Hz pen: beyond this nothing is left.

/// What stands beyond the ends of a curve.
enum class CurveEnds {
  /// p(-k) = 2 p(0) - p(k): the ends stay where the hand set them, and straight lines stay straight.
  mirrored_through_end,
  /// p(-k) = p(k): the literal mirror image; draws the ends inwards.
  mirrored_at_end,
};

struct SmoothingOptions {
  int window = 9;  ///< Odd, 1..255. At 90 Hz a tenth of a second: the period of a hand's tremor (A18).
  int order = 2;   ///< 0..window - 1. Parabolas keep the curve's bending, which a mean would flatten (A18).
  CurveEnds ends = CurveEnds::mirrored_through_end;
};

/// The `window` weights of the samples, the middle one at [window / 2]; their sum is 1. Window 5, order 2:
/// (-3, 12, 17, 12, -3) / 35. Errors: invalid_argument ("window", "order").
Result<std::vector<double>> smoothing_weights(int window, int order);

/// As many points as given; curves shorter than the window are mirrored as often as needed. Errors:
/// invalid_argument ("window", "order", "points[3]" for a coordinate that is not finite).
Result<std::vector<Vec3>> smooth_curve(std::span<const Vec3> points, const SmoothingOptions& options = {});

}  // namespace handloft::geometry
