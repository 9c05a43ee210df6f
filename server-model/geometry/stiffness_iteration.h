#pragma once
// What the iterative solvers of stiffness_solver.h and stiffness_pins.h share. Not for others.

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "server-model/geometry/chunked_sums.h"
#include "server-model/geometry/mode_preconditioner.h"
#include "server-model/geometry/stiffness_solver.h"

namespace handloft::geometry {

inline constexpr int max_restarts = 6;
/// Where restarts no longer help, the residual is rounding when it is below this many units of it.
inline constexpr double rounding_units = 32;

/// What rounding alone may leave of f - K x: the spacing of doubles times |K| |x|.
double rounding(const StiffnessOperator& k, std::span<const double> x, const ParallelFor& parallel);

struct IterationParts {
  std::vector<std::uint32_t> points;  ///< The unknowns.
  StiffnessOperator k;
  ModePreconditioner preconditioner;
};
/// K with ties on those of `grounded` that are `tied`; the preconditioner with ties on all. Errors: as
/// make_iterative_solver().
Result<IterationParts> iteration_parts(const StiffnessProblem& problem,
                                       const std::vector<std::uint32_t>& tied,
                                       const IterativeOptions& options);

}  // namespace handloft::geometry
