#pragma once
// Non-uniform rational B-spline surfaces: tensor products, open or periodic in each direction (Piegl and
// Tiller). The operations on them that keep their shape are in bspline_refine.h.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_curve.h"
#include "server-model/geometry/knot_vector.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

struct SurfaceDerivatives {
  Vec3 s = Vec3::Zero(), su = Vec3::Zero(), sv = Vec3::Zero(), suu = Vec3::Zero(), suv = Vec3::Zero(),
       svv = Vec3::Zero();
};

struct BSplineSurface {
  KnotVector u, v;
  std::vector<Vec3> control;    ///< control(i, j) at i * v.control_count() + j.
  std::vector<double> weights;  ///< In the same order, > 0; empty: all 1.

  bool is_rational() const { return !weights.empty(); }
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(v.control_count()) +
           static_cast<std::size_t>(j);
  }
  const Vec3& at(int i, int j) const { return control[index(i, j)]; }

  /// S(u, v); parameters are wrapped into the domain.
  Vec3 evaluate(double u, double v) const;
  /// With derivatives up to `order` 1 or 2; higher ones stay 0.
  SurfaceDerivatives derivatives(double u, double v, int order) const;
  /// Unit; where both tangents vanish or are parallel (a pole), from the nearest place inside that has one;
  /// zero when there is none.
  Vec3 normal(double u, double v) const;
};

/// Errors, naming the field: invalid_argument for counts that do not fit, numbers that are not finite,
/// weights that are not positive.
Status check(const BSplineSurface& surface);

/// The functions that do not vanish at one place, with their control points: rational where the surface is.
/// d^(a+b) S / du^a dv^b = sum_k value[k] * control[point[k]].
struct SurfaceFunctional {
  std::vector<std::uint32_t> point;  ///< Ascending, each once.
  std::vector<double> value;
};
/// Errors: invalid_argument for a or b below 0 or a + b above 2 (3 for non-rational surfaces).
Result<SurfaceFunctional> surface_functional(const BSplineSurface& surface, double u, double v, int a, int b);

/// All places of a grid at once: S(us[r], vs[c]) at [r * vs.size() + c], and with `normals` not null the unit
/// normals. By rows: first along v, then along u, so that a place costs p + q products instead of p q.
/// For the same grid again and again: GridEvaluator (bspline_grid.h). Precondition: check(surface).
void evaluate_grid(const BSplineSurface& surface, std::span<const double> us, std::span<const double> vs,
                   std::vector<Vec3>& places, std::vector<Vec3>* normals = nullptr);

}  // namespace handloft::geometry
