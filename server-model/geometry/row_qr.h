#pragma once
// Least squares min |A c - b| by QR, one block of rows after the other: keeps only R (p x p), Q^T b (p) and
// the residual norm, so memory does not grow with the rows. Rows come in by Householder (blocks) or Givens
// (single), and leave by hyperbolic downdating. The accuracy is that of Householder QR of the whole matrix.

#include <Eigen/Core>
#include <cstddef>

namespace handloft::geometry {

class RowQr {
 public:
  explicit RowQr(int columns = 0);

  int columns() const { return columns_; }
  std::size_t rows() const { return rows_; }

  /// Appends m rows [A | b]; shape m x (columns + 1), overwritten as workspace.
  void append(Eigen::Ref<Eigen::MatrixXd> rows);
  /// Appends one row of columns + 1 numbers by Givens rotations, O(p^2). `row` is overwritten.
  void add_row(double* row);
  /// Takes a row out that was added before, O(p^2). False (and nothing changed) if the downdate is so
  /// ill-conditioned that it would lose more than half of the digits: then rebuild from the rows that remain.
  [[nodiscard]] bool remove_row(const double* row);

  /// Makes R that of A * upper: new columns that are combinations of the old ones up to the same place; Q^T b
  /// stays. O(p^3 / 3). Shape: columns x columns, upper triangular.
  void transform_columns(const Eigen::Ref<const Eigen::MatrixXd>& upper);

  /// Upper triangular (R | Q^T b; 0 | rho), (columns + 1) x (columns + 1); |rho| is the residual norm.
  const Eigen::MatrixXd& triangle() const { return triangle_; }

  /// Rank of the first `leading` columns by column-pivoted QR with a relative pivot threshold.
  int rank(int leading, double threshold) const;
  /// Coefficients of the problem restricted to the first `leading` columns. Precondition: they have full
  /// rank.
  Eigen::VectorXd solve(int leading) const;
  /// One step of iterative refinement of the solution of all columns, for those who have kept the rows [A |
  /// b] and want every digit: corrected seminormal equations (Bjorck 1987), c += R^-1 R^-T A^T (b - A c), the
  /// residual in extended precision. Costs a pass over A at a fraction of its usual speed.
  void refine(const Eigen::Ref<const Eigen::MatrixXd>& rows, Eigen::VectorXd& c) const;
  /// |A c - b| of that solution.
  double residual_norm(int leading) const;

 private:
  int columns_ = 0;
  std::size_t rows_ = 0;
  Eigen::MatrixXd triangle_;
};

}  // namespace handloft::geometry
