#pragma once
// The small dense system of linear constraints on a minimum of energy (D20). For
//   minimise x^T K x - 2 x^T F  subject to  C x = d,
// with K definite but for modes N that cost no energy, the multipliers l (forces that hold the constraints)
// and the modes' amounts c solve
//   S l + B c = d - C x_F,   B^T l = -N^T F,   S = C K^-1 C^T,   B = C N,   x = x_F + K^-1 C^T l + N c,
// where x_F = K^-1 F. (Where there are modes, K^-1 is that of K with ties on as many points as there are
// modes: the second equation leaves the ties nothing to bear, so any will do.)
//
// Rows that depend on others are found, never divided by: a few anchors among the rows are chosen that pin
// the modes, the modes are eliminated by them, and what remains, a Gram matrix in the inner product of
// energy, is factorised by Cholesky with diagonal pivots until they are rounding. The order of pivots, and
// with it every bit, depends on S and B alone.
//
// Where rows are plenty and none is worth more than another (a curve's places on a large surface), they can
// be told apart more coarsely: soft ones come after the others and are dropped earlier.

#include <Eigen/Core>
#include <Eigen/QR>
#include <cstddef>
#include <vector>

namespace handloft::geometry {

class ConstraintFactor {
 public:
  /// Rows are dependent when their distance from the others' span, in the norm of energy, is below the root
  /// of this part of their own length: some ten times what rounding makes of exact dependence.
  static constexpr double dependence = 1e-11;
  /// The same of soft rows.
  static constexpr double soft_dependence = 1e-9;

  ConstraintFactor() = default;
  /// S, m x m (each half used where it belongs: the upper one for the factor, all for residuals), and B,
  /// m x k, k small, zeros exact; which rows are soft, none where empty. Preconditions: finite; S symmetric
  /// but for rounding, semidefinite. Costs m^3 / 3 multiplications and 2 m^2 numbers, with modes 3.
  ConstraintFactor(Eigen::MatrixXd s, Eigen::MatrixXd b, std::vector<bool> soft = {});

  Eigen::Index rows() const { return s_.rows(); }
  Eigen::Index modes() const { return b_.cols(); }
  /// Rows that the solution meets exactly, by choice of the factor, and those that follow from them, each
  /// ascending.
  const std::vector<Eigen::Index>& kept() const { return kept_; }
  const std::vector<Eigen::Index>& dependent() const { return dependent_; }
  /// The kept rows of which dependent()[at] is a combination, ascending; none where the row is zero.
  std::vector<Eigen::Index> combination(std::size_t at) const;

  /// The part of the modes' load that no row can bear: |.| of each column of N^T F (k x r), to be compared
  /// with what rounding makes. Zero where rows pin all modes.
  double unborne(const Eigen::MatrixXd& mode_loads) const;

  struct Multipliers {
    Eigen::MatrixXd rows;   ///< l, m x r; dependent rows have 0.
    Eigen::MatrixXd modes;  ///< c, k x r; of least norm in what the rows leave open.
  };
  /// With `values` d - C x_F (m x r) and `mode_loads` N^T F (k x r).
  Multipliers solve(const Eigen::MatrixXd& values, const Eigen::MatrixXd& mode_loads) const;
  /// The same with all rows as near as they come: the least sum of squares of residuals, each in units of
  /// what the row yields to a unit force (root of its element of S).
  Multipliers solve_least_squares(const Eigen::MatrixXd& values, const Eigen::MatrixXd& mode_loads);
  /// S l + B c - d: how far each row is off.
  Eigen::MatrixXd residual(const Multipliers& multipliers, const Eigen::MatrixXd& values) const;

 private:
  using Rows = std::vector<Eigen::Index>;

  void choose_anchors();
  void factorise();
  void eliminate(Eigen::VectorXd noise);
  Eigen::Index next_pivot(const Eigen::VectorXd& open, const Eigen::VectorXd& noise, Eigen::Index from) const;
  void swap_rows(Eigen::Index a, Eigen::Index b);
  Multipliers step(const Eigen::MatrixXd& scaled_values, const Eigen::MatrixXd& borne_loads) const;
  void prepare_least_squares();
  Multipliers least_squares_step(const Eigen::MatrixXd& scaled_values,
                                 const Eigen::MatrixXd& borne_loads) const;
  /// Steps towards a solution, each from what the ones before left off.
  template <typename Step>
  Multipliers refined(const Eigen::MatrixXd& values, const Eigen::MatrixXd& mode_loads,
                      const Step& step) const;
  Eigen::MatrixXd borne(const Eigen::MatrixXd& mode_loads) const;
  Multipliers unscaled(const Multipliers& scaled) const;

  bool is_soft(Eigen::Index row) const { return !soft_.empty() && soft_[static_cast<std::size_t>(row)]; }
  /// The pivots' rows of the Cholesky factor.
  auto triangle() const { return lower_.topRows(lower_.cols()); }

  Eigen::MatrixXd s_, b_;
  std::vector<bool> soft_;
  Eigen::VectorXd scale_;     // Root of S's diagonal; 1 for rows of zeros.
  Eigen::MatrixXd scaled_;    // S, exactly symmetric, with unit diagonal; none where there are no anchors.
  Eigen::MatrixXd pinned_;    // The modes that rows pin: an orthonormal basis, k x p.
  Eigen::MatrixXd scaled_b_;  // m x p.
  Rows anchors_, others_;     // p rows, and the rest, ascending.
  Eigen::MatrixXd anchor_inverse_;  // Of scaled_b_'s anchor rows, p x p.
  Eigen::MatrixXd by_anchors_;      // T: others' rows of B as combinations of the anchors'.
  Eigen::MatrixXd lower_;           // Of the others, in order_: Cholesky's factor, one column a pivot.
  Rows order_;                      // By its rows: places in others_.
  Rows place_of_;                   // By place in others_: its row.
  Rows pivots_;                     // The first of order_: those eliminated.
  Rows kept_, dependent_;
  Eigen::MatrixXd spanned_;  // What the kept rows bring about: anchors, then others. Made when asked for.
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> responses_;  // Of it.
  bool has_responses_ = false;
};

}  // namespace handloft::geometry
