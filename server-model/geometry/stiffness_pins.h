#pragma once
// Curves and regions that hold very large surfaces: K x = F where C x = d holds as well, by conjugate
// gradients in the null space of C (Gould, Hribar and Nocedal 2001, "On the solution of equality constrained
// quadratic programming problems"). The preconditioner of mode_preconditioner.h is projected, exactly, by the
// small dense matrix C P^-1 C^T, so that the iterations are no more than without C, and no answer of the
// surface to each row of C is ever kept: a thousand rows on a million control points would be eight
// gigabytes.

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/constraint_factor.h"
#include "server-model/geometry/sculpt_places.h"
#include "server-model/geometry/stiffness_solver.h"

namespace handloft::geometry {

/// What is pinned, at places that are given with every solution.
struct StiffnessPins {
  std::vector<std::uint32_t> points;    ///< Control points, ascending (a region).
  std::vector<SurfaceFunctional> rows;  ///< Sums of control points (the places of a curve).

  std::size_t size() const { return points.size() + rows.size(); }
  bool empty() const { return size() == 0; }
  bool operator==(const StiffnessPins&) const;
};

class PinnedSolver : public StiffnessSolver {
 public:
  /// X of least energy with the pins at `values`: pins.size() x r, points first; displacements. Pins that
  /// follow from others (dependent()) are where those say. Errors: as solve().
  virtual Result<Eigen::MatrixXd> follow(const Eigen::MatrixXd& values) const = 0;

  /// Pins that follow from others or from supports, ascending.
  virtual const std::vector<std::size_t>& dependent() const = 0;
  /// How much of a functional of the unknowns the pins leave open, 0 to 1, as part of its square in the norm
  /// of (about) the energy's inverse; rounding leaves some 1e-12 of nothing.
  virtual double freedom(const std::vector<Eigen::Index>& at, const std::vector<double>& value) const = 0;
  /// Takes from forces (n x r) what the pins bear.
  virtual void release(Eigen::MatrixXd& forces) const = 0;
};

/// solve() is that of the surface with its pins where they were: its X has them at 0. Errors: as
/// make_iterative_solver(), and resource_exhausted for more than `max_pins` that bear: of points those beside
/// ones that may move, of rows all.
inline constexpr std::size_t max_pins = 4096;
/// `loose`: the ties of the problem that the pins leave needed (sculpt_setup.cpp), a part of its `grounded`.
Result<std::unique_ptr<PinnedSolver>> make_pinned_solver(const StiffnessProblem& problem,
                                                         const StiffnessPins& pins,
                                                         const std::vector<std::uint32_t>& loose,
                                                         const IterativeOptions& options = {});

}  // namespace handloft::geometry
