#pragma once
// The energy of a deformable B-spline surface or curve (requirements D1 to D4; Celniker and Gossard 1991,
// with the printed equations put right), as a quadratic form in its control points:
//   E = x^T K x - 2 x^T F,
//   K = a11 K10,10 + a12 (K10,01 + K01,10) + a22 K01,01 + b11 K20,20 + 2 b12 K11,11 + b22 K02,02,
// where Kab,cd is the integral of products of derivatives. One K serves x, y and z. Because the functions are
// products, each term is a Kronecker product of Gram matrices of one direction.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/knot_vector.h"

namespace handloft::geometry {

/// Stretching (a) and bending (b), in parameters as long as the surface is (scaled_domain()). Valid: finite,
/// a11 a22 >= a12^2, none of a11, a22, b11, b12, b22 negative, and not all zero.
struct SculptEnergy {
  double a11 = 0.05, a12 = 0, a22 = 0.05;  ///< A little membrane keeps far parts quiet (D2).
  double b11 = 1, b12 = 1, b22 = 1;        ///< Equal: the isotropic thin plate.

  bool operator==(const SculptEnergy&) const = default;
};
Status check(const SculptEnergy& energy);

/// How a side of the parameter rectangle is held. A periodic direction has no sides.
enum class Support : std::uint8_t {
  free,       ///< Nothing; loads must then be borne by constraints.
  supported,  ///< The outer row of control points stays: positions hold, tangents turn (simply supported).
  clamped,    ///< The two outer rows stay: positions and tangents hold.
};
struct SculptSupports {
  Support u_lower = Support::clamped, u_upper = Support::clamped;
  Support v_lower = Support::clamped, v_upper = Support::clamped;

  bool operator==(const SculptSupports&) const = default;
};

/// The integrals of N_i^(a) N_j^(b) over the domain, n x n by control values, a and b <= 2: exact by Gauss
/// points, p + 1 a span. Symmetric when a = b, and (a, b) the transpose of (b, a), to the bit; all of one
/// sparsity pattern: zeros that derivatives bring are kept.
Eigen::SparseMatrix<double> gram_matrix(const KnotVector& knots, int a, int b);

/// K of a surface over its knots (its weights are not asked: displacements are measured as polynomial ones),
/// in the order of its control points. Symmetric to the bit.
Eigen::SparseMatrix<double> stiffness(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy);
/// Its part for some rows by some columns of control points, each ascending.
Eigen::SparseMatrix<double> stiffness(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy,
                                      const std::vector<std::uint32_t>& rows,
                                      const std::vector<std::uint32_t>& columns);

/// K x without K: by the terms' Kronecker factors, O(degree) a point and no memory to speak of.
class StiffnessProduct {
 public:
  StiffnessProduct(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy);
  /// All control points, in their order. Precondition: as many as the knots say.
  Eigen::VectorXd operator()(const Eigen::VectorXd& x) const;

 private:
  struct Term {
    Eigen::SparseMatrix<double, Eigen::RowMajor> u, v;
  };
  std::vector<Term> terms_;
};

/// Of a curve, alpha |w_u|^2 + beta |w_uu|^2 (D1).
Eigen::SparseMatrix<double> curve_stiffness(const KnotVector& knots, double alpha, double beta);

/// Which control points may move, ascending: all but the rows that the supports hold.
std::vector<std::uint32_t> movable_points(const KnotVector& u, const KnotVector& v,
                                          const SculptSupports& supports);

}  // namespace handloft::geometry
