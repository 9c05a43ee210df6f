#pragma once
// The exact conversion of a polynomial surface over a rectangle into a tensor-product Bezier patch (a
// B-spline without inner knots) of degree N x N in world coordinates: what STEP and other CAD formats hold
// (A26).

#include <cstddef>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// S(u, v) = sum_ij B_i(u) B_j(v) control(i, j), u and v in 0..1 along the frame's x and y.
struct BezierPatch {
  int degree = 1;             ///< In u and in v.
  std::vector<Vec3> control;  ///< (degree + 1)^2 points, row i (u) by row.

  const Vec3& at(int i, int j) const {
    return control[static_cast<std::size_t>(i) * static_cast<std::size_t>(degree + 1) +
                   static_cast<std::size_t>(j)];
  }
  /// By de Casteljau.
  Vec3 evaluate(double u, double v) const;
};

/// Errors: invalid_argument for a box without area or with numbers that are not finite.
Result<BezierPatch> to_bezier_patch(const PolynomialSurface& surface, const Frame& frame, const Box2& box);

}  // namespace handloft::geometry
