#pragma once
// Levenberg-Marquardt on sparse blocks (Triggs, McLauchlan, Hartley, Fitzgibbon, "Bundle adjustment: a modern
// synthesis", 1999; damping as Nielsen 1999). The normal equations are gathered block by block and solved as
// one dense symmetric system: a calibration has a few hundred to a few thousand unknowns. Ceres' own
// ceres::Problem would do, too, but Debian's library is linked with SuiteSparse's GPL parts, which this
// project's licence keeps out (README: of Ceres only headers are used).

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>

namespace handloft::tracking {

/// J^T W J and J^T W r of a problem, gathered residual by residual in the order of the calls.
class NormalEquations {
 public:
  explicit NormalEquations(Eigen::Index unknowns);

  /// The derivatives of one residual (two rows: a pixel) for the unknowns from `first` on.
  struct Block {
    Eigen::Index first = 0;
    Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, 9> jacobian;
  };
  /// Adds weight * (r + J d)^2.
  void add(std::span<const Block> blocks, const Eigen::Vector2d& residual, double weight);
  /// Pulls one unknown towards a step of `step` with so many inverse variances.
  void add_prior(Eigen::Index unknown, double step, double information);

  Eigen::Index unknowns() const { return gradient_.size(); }
  /// The step that minimises the damped quadratic; nullopt when the system is singular.
  std::optional<Eigen::VectorXd> solve(double damping) const;
  /// (J^T W J)^-1: the covariance of the unknowns when residuals are in sigmas; nullopt when some unknown is
  /// not determined.
  std::optional<Eigen::MatrixXd> covariance() const;
  const Eigen::VectorXd& gradient() const { return gradient_; }

 private:
  Eigen::MatrixXd matrix_;  ///< Lower triangle.
  Eigen::VectorXd gradient_;
};

struct LeastSquaresOptions {
  int max_iterations = 60;
  double converged_share = 1e-10;  ///< Of the cost: a smaller gain is only rounding.
  double first_damping = 1e-4;     ///< Of the diagonal.
};

struct LeastSquaresOutcome {
  double cost = 0.0;  ///< Sum of the losses, squared sigmas.
  int iterations = 0;
  bool converged = false;
};

/// What is minimised, seen from the solver. `evaluate` gives the cost of a trial and, when asked, gathers the
/// equations; nullopt when the trial is impossible (a point behind its camera).
struct LeastSquaresProblem {
  Eigen::Index unknowns = 0;
  /// Cost at the current state.
  std::function<std::optional<double>(NormalEquations*)> evaluate;
  /// Moves the state by a step and remembers the one before.
  std::function<void(const Eigen::VectorXd&)> apply;
  /// Goes back to the remembered state.
  std::function<void()> undo;
};

/// nullopt when the start itself is impossible or no step can be solved for.
std::optional<LeastSquaresOutcome> minimise(const LeastSquaresProblem& problem,
                                            const LeastSquaresOptions& options = {});

/// Huber's loss (1964) of a residual of squared length `squared`, and the weight of its squared form.
struct HuberLoss {
  double loss = 0.0, weight = 1.0;
};
HuberLoss huber(double squared, double threshold);

}  // namespace handloft::tracking
