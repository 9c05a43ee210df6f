#pragma once
// Non-uniform rational B-spline curves in space (Piegl and Tiller). The operations on them that keep their
// shape are in bspline_refine.h.

#include <array>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/knot_vector.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

struct BSplineCurve {
  KnotVector knots;
  std::vector<Vec3> control;
  std::vector<double> weights;  ///< One a control point, > 0; empty: all 1.

  bool is_rational() const { return !weights.empty(); }
  /// c(u); u is wrapped into the domain.
  Vec3 evaluate(double u) const;
  /// c, c', ..., up to `order` <= 3, in that order; the rest is 0.
  std::array<Vec3, 4> derivatives(double u, int order) const;
};

/// Errors, naming the field: invalid_argument for counts that do not fit, numbers that are not finite,
/// weights that are not positive.
Status check(const BSplineCurve& curve);

}  // namespace handloft::geometry
