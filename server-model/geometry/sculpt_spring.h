#pragma once
// How stiff the spring must be that turns a hand's displacement into a force, so that the surface follows the
// hand (D15, D16; the paper's section on interactive dragging). A force f = k dx moves the icon by dy.

#include <functional>

#include "common/base/result.h"

namespace handloft::geometry {

/// The stiffness with dy = dx: the reciprocal of the compliance (SculptSystem::compliance() of unit loads).
/// Errors: failed_precondition where the compliance is not above 0: the icon is held.
Result<double> matching_stiffness(double compliance);

struct AdaptedStiffness {
  double stiffness = 0;
  double ratio = 0;    ///< dy / dx with it.
  int iterations = 0;  ///< How often `ratio_of` was asked but for the first time.
};
/// The paper's loop, for parity: starts at k0 = alpha S (S the surface's area or the curve's length), asks
/// for dy / dx, raises k where that is below 0.8 and lowers it above 1.2, by k <- k dx / dy. Errors:
/// invalid_argument for a start that is not above 0; failed_precondition when the ratio is not above 0 (what
/// does not move along cannot be matched) or `max_iterations` have passed.
inline constexpr double least_ratio = 0.8, greatest_ratio = 1.2;
Result<AdaptedStiffness> adapt_stiffness(double start, const std::function<Result<double>(double)>& ratio_of,
                                         int max_iterations = 10);

}  // namespace handloft::geometry
