#include "server-model/geometry/sculpt_spring.h"

#include <fmt/format.h>

#include <cmath>

namespace handloft::geometry {

Result<double> matching_stiffness(double compliance) {
  const double stiffness = 1 / compliance;
  if (!(compliance > 0) || !std::isfinite(stiffness) || !(stiffness > 0))
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("found compliance {}, expected an icon that is free to move", compliance),
                      "compliance");
  return stiffness;
}

Result<AdaptedStiffness> adapt_stiffness(double start, const std::function<Result<double>(double)>& ratio_of,
                                         int max_iterations) {
  if (!(start > 0) || !std::isfinite(start))
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected above 0 N/m", start),
                      "start");
  AdaptedStiffness found{start, 0, 0};
  for (;; ++found.iterations) {
    const Result<double> ratio = ratio_of(found.stiffness);
    if (!ratio) return ratio.error();
    if (!(*ratio > 0) || !std::isfinite(*ratio))
      return make_error(ErrorCode::failed_precondition,
                        fmt::format("found dy/dx = {}, expected an icon that follows", *ratio), "ratio");
    found.ratio = *ratio;
    if (found.ratio >= least_ratio && found.ratio <= greatest_ratio) return found;
    if (found.iterations == max_iterations) break;
    found.stiffness /= found.ratio;
  }
  return make_error(ErrorCode::failed_precondition,
                    fmt::format("found dy/dx = {} after {} steps, expected {} to {}", found.ratio,
                                max_iterations, least_ratio, greatest_ratio),
                    "ratio");
}

}  // namespace handloft::geometry
