#pragma once
// The Gram matrices of one direction, cut to the unknowns that the supports leave, by their diagonals; and K
// x from those of two directions without K: O(degree) an unknown, by rows of control points, in parallel.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server-model/geometry/propagation.h"
#include "server-model/geometry/sculpt_energy.h"

namespace handloft::geometry {

/// Square; element (i, i + d) at diagonal(d)[i] for |d| <= reach, counted round where it is cyclic, else 0
/// for columns that do not exist.
class BandMatrix {
 public:
  BandMatrix() = default;
  /// The rows and columns `chosen` (ascending, not empty) of a matrix. Elements must lie within `reach` of
  /// the diagonal of what is left (round the corner when cyclic); 2 reach < chosen.size() when cyclic.
  BandMatrix(const Eigen::SparseMatrix<double>& matrix, const std::vector<std::uint32_t>& chosen,
             std::size_t reach, bool cyclic);

  std::size_t size() const { return size_; }
  std::size_t reach() const { return reach_; }
  bool cyclic() const { return cyclic_; }
  const double* diagonal(std::ptrdiff_t d) const {
    return elements_.data() + static_cast<std::size_t>(d + static_cast<std::ptrdiff_t>(reach_)) * size_;
  }
  double at(std::size_t row, std::size_t column) const;
  Eigen::MatrixXd dense() const;
  /// Absolute values.
  BandMatrix absolute() const;
  bool is_zero() const;
  friend BandMatrix operator+(BandMatrix a, const BandMatrix& b);  ///< Precondition: alike.
  friend BandMatrix operator*(double factor, BandMatrix a);

 private:
  std::size_t size_ = 0, reach_ = 0;
  bool cyclic_ = false;
  std::vector<double> elements_;
};

struct StiffnessAxis {
  BandMatrix mass, slope, bending;      ///< Integrals of N N, N' N', N'' N''.
  BandMatrix slope_value, value_slope;  ///< N_i' N_j and N_i N_j'.
  int free_sides = 0;                   ///< 0 to 2.
  double length = 0;

  std::size_t size() const { return mass.size(); }
};
/// Of the unknowns that the supports leave. Precondition: there are some.
StiffnessAxis stiffness_axis(const KnotVector& knots, Support lower, Support upper);
/// Of any others: ascending, each once, not empty. A side is free when its outermost control point is there.
StiffnessAxis stiffness_axis(const KnotVector& knots, const std::vector<std::uint32_t>& unknowns);

/// y = K x, x(i, j) at i * v.size() + j.
class StiffnessOperator {
 public:
  /// A stiffness on the diagonal.
  struct Tie {
    std::size_t unknown;
    double stiffness;
  };
  StiffnessOperator(const StiffnessAxis& u, const StiffnessAxis& v, const SculptEnergy& energy,
                    std::vector<Tie> ties);

  std::size_t size() const { return rows_ * columns_; }
  void apply(std::span<const double> x, std::span<double> y, const ParallelFor& parallel) const;
  /// With the absolute values of all that is added: times |x| it bounds what rounding does to K x.
  StiffnessOperator absolute() const;

 private:
  struct Term {
    BandMatrix u, v;
  };
  void apply_rows(std::size_t first, std::size_t last, const double* x, double* y) const;

  std::size_t rows_, columns_;
  std::vector<Term> terms_;
  std::vector<Tie> ties_;
};

}  // namespace handloft::geometry
