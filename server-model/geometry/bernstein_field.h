#pragma once
// Tensor-product polynomials in Bernstein form, whose coefficients bound them: products, cuts, and where they
// rise and bend (Farouki, "The Bernstein polynomial basis: a centennial retrospective", 2012). For the
// searches of SurfaceProjector.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "server-model/geometry/types.h"

namespace handloft::geometry::detail {

/// Binomials' products that multiply Bernstein polynomials: C(p, i) C(p, j) / C(2p, i + j).
class ProductWeights {
 public:
  explicit ProductWeights(int degree) : order_(static_cast<std::size_t>(degree) + 1) {
    std::vector<double> once = row(degree), twice = row(2 * degree);
    for (std::size_t i = 0; i < order_; ++i) {
      for (std::size_t j = 0; j < order_; ++j) values_.push_back(once[i] * once[j] / twice[i + j]);
    }
  }
  double operator()(std::size_t i, std::size_t j) const { return values_[i * order_ + j]; }

 private:
  static std::vector<double> row(int n) {
    std::vector<double> binomials(static_cast<std::size_t>(n) + 1, 1.0);
    for (std::size_t k = 1; k < binomials.size(); ++k) {
      binomials[k] = binomials[k - 1] * static_cast<double>(binomials.size() - k) / static_cast<double>(k);
    }
    return binomials;
  }
  std::size_t order_;
  std::vector<double> values_;
};

/// What holds over a whole box for a Bernstein polynomial.
struct FieldShape {
  bool convex = true;  ///< Strictly, in both directions together.
  std::array<bool, 2> bends_up = {true, true};
  std::array<int, 2> slope = {0, 0};  ///< +1 where it rises, -1 where it falls.

  void meet(const FieldShape& other) {
    convex = convex && other.convex;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      bends_up[axis] = bends_up[axis] && other.bends_up[axis];
      if (slope[axis] != other.slope[axis]) slope[axis] = 0;
    }
  }
  /// No box has two places where it is locally least within the box.
  bool one_minimum() const {
    return convex || (slope[0] != 0 && slope[1] != 0) || (slope[0] != 0 && bends_up[1]) ||
           (slope[1] != 0 && bends_up[0]);
  }
};

FieldShape shape_of(std::span<const double> field, int nu, int nv);

/// Cuts a tensor-product Bernstein polynomial of degrees (nu, nv) in u and, where nv > 0, in v at places in
/// 0..1: children one after another, (low u, low v), (low u, high v), (high u, low v), (high u, high v); two
/// when nv is 0.
void split_field(const double* in, int nu, int nv, const Vec2& at, double* out);

}  // namespace handloft::geometry::detail
