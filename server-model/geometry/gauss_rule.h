#pragma once
// Gauss-Legendre quadrature: `count` nodes integrate polynomials up to degree 2 count - 1 exactly.

#include <vector>

namespace handloft::geometry {

struct GaussRule {
  std::vector<double> node, weight;  ///< On [-1, 1], ascending.
};
/// Precondition: count >= 1.
GaussRule gauss_rule(int count);

}  // namespace handloft::geometry
