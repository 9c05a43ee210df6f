#pragma once
// B-spline surfaces at all places of a grid of parameters, again and again: the tables of basis functions
// (and the denominators of rational surfaces) are kept, so that a drag pays for sums alone. Row by row, first
// along u, then along v: a place costs about p + q products instead of p q.

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/knot_vector.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// Places us[r] x vs[c]; wrapped into the domain. Immutable: any number of threads may use one, and rows in
/// any portions give the same bits.
class GridEvaluator {
 public:
  /// For surfaces with these knots and weights. Precondition: check(surface). Its control points are not
  /// kept.
  GridEvaluator(const BSplineSurface& surface, std::span<const double> us, std::span<const double> vs);

  std::size_t rows() const { return in_u_.size(); }
  std::size_t columns() const { return in_v_.size(); }
  std::size_t size() const { return rows() * columns(); }

  /// values[(r * columns() + c) * k + m] = sum_i R_i(us[r], vs[c]) field[i * k + m]: k numbers a control
  /// point (displacements, one coordinate, ...). Rows first .. first + count - 1; values holds these alone.
  /// Errors: invalid_argument for a k below 1, rows outside the grid and sizes that do not fit.
  Status evaluate(std::span<const double> field, std::size_t k, std::span<double> values) const;
  Status evaluate(std::span<const double> field, std::size_t k, std::size_t first, std::size_t count,
                  std::span<double> values) const;

  /// The places of a surface with such knots and weights. Errors: as above.
  Status evaluate(const BSplineSurface& surface, std::vector<Vec3>& places) const;
  /// And its unit normals, as BSplineSurface::normal() has them at poles.
  Status evaluate(const BSplineSurface& surface, std::vector<Vec3>& places, std::vector<Vec3>& normals) const;

 private:
  Status check_rows(std::size_t field, std::size_t k, std::size_t first, std::size_t count,
                    std::size_t values) const;

  KnotVector u_, v_;
  std::vector<double> weights_;
  std::vector<double> us_, vs_;
  BasisTable in_u_, in_v_;          ///< Values and first derivatives.
  std::vector<double> reciprocal_;  ///< 1 / W at each place of a rational surface.
};

}  // namespace handloft::geometry
