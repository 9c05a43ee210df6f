#pragma once
// A preconditioner for the stiffness of very large surfaces: diagonal in the vibrations of one direction,
// direct along the other.
//
// K = B (x) M + 2 b12 A (x) A + M (x) B (and the stretching terms), M, A and B the integrals of N N, N' N'
// and N'' N''. With the vibrations U of a free or held beam, U^T B U diagonal and U^T M U = 1 along one
// direction, only the middle term couples them. Leaving its off-diagonal elements out leaves for each
// vibration k one band matrix  b_k M + 2 b12 a_k A + B  along the other direction, which is factorised. That
// is equivalent to K with constants that do not depend on how fine the knots are, nor on how they are spaced:
// for held sides the twist's part is at most the bending's, (b_k + B)/2 in the same place; for free ones by
// the coercivity of (d2/du2, d2/dv2), which have no common direction (Aronszajn; Agmon), up to what those do
// not see: 1, u, v, u v. The lowest vibrations, to which those belong, keep all their couplings, and the
// ties. The pair (A, M) of the usual fast diagonalisation (Lynch, Rice and Thomas 1964) does not have this
// property at free and clamped sides, where B differs from A M^-1 A without bound. Cost of an application:
// two dense products, 4 n^2 m operations for n vibrations over m rows.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/bordered_cholesky.h"
#include "server-model/geometry/stiffness_axis.h"

namespace handloft::geometry {

/// Rows of a matrix over the unknowns, seen in the vibrations: ModePreconditioner::rows().
struct ModeRows {
  std::vector<std::size_t> start;  ///< Of each row its first entry; and the end.
  std::vector<std::size_t> line;   ///< By entry: the lines that a row touches.
  std::vector<Lanes> modes;        ///< By panel, then entry: eight vibrations' values there.

  std::size_t size() const { return start.size() - 1; }
};
struct SparseRow {
  std::vector<std::size_t> at;  ///< Unknowns.
  std::vector<double> value;
};

class ModePreconditioner {
 public:
  /// Finding the vibrations takes O(n^3) of the shorter direction: about 1.5 s for 1000, so more is refused.
  static constexpr std::size_t max_modes = 3000;

  /// Errors: resource_exhausted (both directions longer than max_modes); failed_precondition when K is not
  /// positive definite: nothing holds the surface.
  static Result<ModePreconditioner> create(const StiffnessAxis& u, const StiffnessAxis& v,
                                           const SculptEnergy& energy,
                                           std::span<const StiffnessOperator::Tie> ties,
                                           const ParallelFor& parallel);

  /// z = P^-1 r: linear, symmetric and positive. As StiffnessOperator counts the unknowns.
  void apply(std::span<const double> r, std::span<double> z, const ParallelFor& parallel) const;

  ModeRows rows(std::span<const SparseRow> c) const;
  /// C P^-1 C^T, symmetric to the bit. Cost: a band's solution a row and vibration, and m^2 products each.
  Eigen::MatrixXd gram(const ModeRows& c, const ParallelFor& parallel) const;
  /// z = P^-1 (r - C^T l) with l = bear(C P^-1 r), which is returned: for little more than apply().
  using Bear = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;
  Eigen::VectorXd apply_bearing(std::span<const double> r, const ModeRows& c, const Bear& bear,
                                std::span<double> z, const ParallelFor& parallel) const;

 private:
  /// Where a direction of vibrations and one of lines stand in the unknowns.
  struct Layout {
    std::size_t modes = 0, lines = 0;
    std::size_t mode_stride = 0, line_stride = 0;
  };
  ModePreconditioner() = default;
  void solve_panel(std::size_t panel, Lanes* places) const;
  bool factor_lowest(const StiffnessAxis& line, const SculptEnergy& energy,
                     std::span<const StiffnessOperator::Tie> ties, const Eigen::MatrixXd& vibrations,
                     const StiffnessAxis& modal);
  void to_modes(std::span<const double> r, std::size_t group, Lanes* modes) const;
  void from_modes(const Lanes* modes, std::size_t group, std::span<double> z) const;

  Layout layout_;
  std::size_t panels_ = 0, padded_lines_ = 0;
  std::vector<double> to_modes_, from_modes_;  ///< U^T and U by panels of eight rows, their columns in turn.
  BorderedCholesky<double> lowest_;            ///< Of the first panel's vibrations together.
  std::vector<BorderedCholesky<Lanes>> higher_;
};

}  // namespace handloft::geometry
