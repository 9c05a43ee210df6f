#pragma once
// K X = F for many right-hand sides (architecture idea 4: what stays the same is prepared once). The direct
// solver factorises; the iterative one is for surfaces whose factor would take minutes and gigabytes.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/propagation.h"
#include "server-model/geometry/sculpt_energy.h"

namespace handloft::geometry {

class StiffnessSolver {
 public:
  virtual ~StiffnessSolver() = default;

  /// How many unknowns: the movable control points.
  virtual Eigen::Index size() const = 0;

  /// X with K X = F, a column for each of F's. A column's bits depend on that column of F alone, not on its
  /// neighbours nor on the number of threads. Errors: failed_precondition when an iteration does not reach
  /// its residual.
  virtual Result<Eigen::MatrixXd> solve(const Eigen::MatrixXd& f) const = 0;

  /// Of the last columns: |K x - f| / |f| at most, and how many iterations at most (0: direct).
  struct Report {
    double relative_residual = 0;
    int iterations = 0;
  };
  virtual Report report() const = 0;
};

struct StiffnessProblem {
  KnotVector u, v;
  SculptEnergy energy;
  SculptSupports supports;
  /// Unknowns (by their index in the surface, ascending, each once) tied to their places: `ground_stiffness`
  /// > 0 is added to their diagonal elements of K, which is singular where nothing holds the surface. Of the
  /// order of the bending stiffness over the surface's area, more only makes the iteration longer.
  /// sculpt_system.h, which ties them, takes the effect out again exactly.
  std::vector<std::uint32_t> grounded = {};
  double ground_stiffness = 0;
  /// Further control points that stay in their places, ascending. The iterative solver takes them where what
  /// is left are rows by columns of control points (the inside of a region is).
  std::vector<std::uint32_t> held = {};
};
/// The unknowns, ascending: movable_points() of the supports without the held ones.
std::vector<std::uint32_t> unknowns(const StiffnessProblem& problem);

/// The rows (of u) and columns (of v) in which the unknowns lie, ascending.
struct UnknownGrid {
  std::vector<std::uint32_t> rows, columns;
  bool full = false;  ///< Every row by every column is an unknown.
};
UnknownGrid grid_of(const std::vector<std::uint32_t>& unknowns, const KnotVector& v);
/// The rows and columns of some control points, ascending.
Eigen::SparseMatrix<double> principal_part(const Eigen::SparseMatrix<double>& k,
                                           const std::vector<std::uint32_t>& points);

/// By sparse LDL^T (Eigen's SimplicialLDLT, fill-reducing order), in the order of unknowns(). Errors:
/// invalid_argument (numbers, points that are not there, nothing movable); failed_precondition where the
/// energy lets the surface move without resistance; resource_exhausted above
/// `max_direct_unknowns`.
inline constexpr std::size_t max_direct_unknowns = 60'000;
Result<std::unique_ptr<StiffnessSolver>> make_direct_solver(const StiffnessProblem& problem);
/// The same of any symmetric matrix.
Result<std::unique_ptr<StiffnessSolver>> make_direct_solver(const Eigen::SparseMatrix<double>& k);

/// By conjugate gradients (mode_preconditioner.h), to a relative residual, or as near to it as doubles come:
/// |K| |x| is 1e8 |f| and more at a million unknowns, so that rounding x alone leaves some 1e-8, and more
/// where the surface can move far; report() says what was reached. Errors: as above, but unsupported when
/// points are held so that the unknowns are no full grid; resource_exhausted above
/// ModePreconditioner::max_modes in both directions.
struct IterativeOptions {
  double relative_residual = 1e-10;
  /// What is taken where further iterations bring nothing: rows that are hard to tell apart leave the
  /// projection fewer digits. No more than `relative_residual` asks for where that is larger.
  double acceptable_residual = 0;
  int max_iterations = 400;
  ParallelFor parallel = run_in_turn;
  /// For make_stiffness_solver(): so many unknowns are factorised, more are iterated; at most
  /// `max_direct_unknowns`.
  std::size_t direct_unknowns = max_direct_unknowns;
};
Result<std::unique_ptr<StiffnessSolver>> make_iterative_solver(const StiffnessProblem& problem,
                                                               const IterativeOptions& options = {});

/// Direct up to `options.direct_unknowns`, iterative above.
Result<std::unique_ptr<StiffnessSolver>> make_stiffness_solver(const StiffnessProblem& problem,
                                                               const IterativeOptions& options = {});

}  // namespace handloft::geometry
