#include "daemon-tracking/calibration/least_squares.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace handloft::tracking {
namespace {

constexpr double largest_damping = 1e12;
// A diagonal that nothing adds to: the unknown is told nothing of; the damping alone keeps it where it is.
constexpr double smallest_diagonal = 1e-12;
// Beyond this ratio of the pivots an unknown is not determined.
constexpr double singular_share = 1e-14;

}  // namespace

NormalEquations::NormalEquations(Eigen::Index unknowns)
    : matrix_(Eigen::MatrixXd::Zero(unknowns, unknowns)), gradient_(Eigen::VectorXd::Zero(unknowns)) {}

void NormalEquations::add(std::span<const Block> blocks, const Eigen::Vector2d& residual, double weight) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto weighted = (weight * blocks[i].jacobian.transpose()).eval();
    gradient_.segment(blocks[i].first, weighted.rows()) += weighted * residual;
    for (std::size_t j = 0; j < blocks.size(); ++j) {
      // The lower triangle; the same unknowns may stand in two blocks of a residual.
      if (blocks[j].first > blocks[i].first) continue;
      matrix_.block(blocks[i].first, blocks[j].first, weighted.rows(), blocks[j].jacobian.cols()) +=
          weighted * blocks[j].jacobian;
    }
  }
}

void NormalEquations::add_prior(Eigen::Index unknown, double step, double information) {
  matrix_(unknown, unknown) += information;
  gradient_[unknown] -= information * step;
}

std::optional<Eigen::VectorXd> NormalEquations::solve(double damping) const {
  Eigen::MatrixXd damped = matrix_;
  // Scaled by the diagonal: focal lengths in pixels and rotations in radians differ by 1e5.
  Eigen::VectorXd scale(unknowns());
  for (Eigen::Index i = 0; i < unknowns(); ++i) {
    const double diagonal = std::max(matrix_(i, i), smallest_diagonal);
    scale[i] = 1.0 / std::sqrt(diagonal);
    damped(i, i) = diagonal * (1.0 + damping);
  }
  damped = scale.asDiagonal() * damped * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower> factor(damped);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return std::nullopt;
  const Eigen::VectorXd step = -(scale.asDiagonal() * factor.solve(scale.asDiagonal() * gradient_));
  if (!step.allFinite()) return std::nullopt;
  return step;
}

std::optional<Eigen::MatrixXd> NormalEquations::covariance() const {
  Eigen::VectorXd scale(unknowns());
  for (Eigen::Index i = 0; i < unknowns(); ++i) {
    if (!(matrix_(i, i) > smallest_diagonal)) return std::nullopt;
    scale[i] = 1.0 / std::sqrt(matrix_(i, i));
  }
  const Eigen::MatrixXd scaled = scale.asDiagonal() * matrix_ * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd, Eigen::Lower> factor(scaled);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return std::nullopt;
  const Eigen::VectorXd pivots = factor.vectorD();
  if (unknowns() > 0 && !(pivots.minCoeff() > singular_share * pivots.maxCoeff())) return std::nullopt;
  const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(unknowns(), unknowns()));
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

std::optional<LeastSquaresOutcome> minimise(const LeastSquaresProblem& problem,
                                            const LeastSquaresOptions& options) {
  LeastSquaresOutcome outcome;
  double damping = options.first_damping, growth = 2.0;
  for (; outcome.iterations < options.max_iterations; ++outcome.iterations) {
    NormalEquations equations(problem.unknowns);
    const std::optional<double> cost = problem.evaluate(&equations);
    if (!cost || !std::isfinite(*cost)) return std::nullopt;
    outcome.cost = *cost;
    bool better = false;
    double gain = 0.0;
    while (!better && damping < largest_damping) {
      const auto step = equations.solve(damping);
      if (step) {
        problem.apply(*step);
        const std::optional<double> trial = problem.evaluate(nullptr);
        if (trial && std::isfinite(*trial) && *trial <= *cost) {
          better = true;
          gain = *cost - *trial;
          outcome.cost = *trial;
        } else {
          problem.undo();
        }
      }
      if (!better) {
        damping *= growth;
        growth *= 2.0;
      }
    }
    if (!better || gain <= options.converged_share * (*cost)) {
      outcome.converged = true;
      return outcome;
    }
    damping = std::max(damping / 5.0, 1e-12);
    growth = 2.0;
  }
  return outcome;
}

HuberLoss huber(double squared, double threshold) {
  if (squared <= threshold * threshold) return {squared, 1.0};
  const double length = std::sqrt(squared);
  return {2.0 * threshold * length - threshold * threshold, threshold / length};
}

}  // namespace handloft::tracking
