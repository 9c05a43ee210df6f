// The iterative solver of stiffness_solver.h: conjugate gradients (Hestenes and Stiefel 1952) with the
// preconditioner of mode_preconditioner.h, restarted from the true residual as often as that pays.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <new>

#include "server-model/geometry/stiffness_iteration.h"

namespace handloft::geometry {

namespace {

using Vector = std::vector<double>;

class IterativeSolver final : public StiffnessSolver {
 public:
  IterativeSolver(StiffnessOperator k, ModePreconditioner preconditioner, const IterativeOptions& options)
      : k_(std::move(k)),
        preconditioner_(std::move(preconditioner)),
        options_(options),
        sums_(k_.size(), options.parallel) {}

  Eigen::Index size() const override { return static_cast<Eigen::Index>(k_.size()); }
  Result<Eigen::MatrixXd> solve(const Eigen::MatrixXd& f) const override;
  Report report() const override { return {residual_, iterations_}; }

 private:
  Result<Report> solve_column(std::span<const double> f, std::span<double> x) const;
  int reduce(Vector& r, double target, int iterations, Vector& x) const;

  StiffnessOperator k_;
  ModePreconditioner preconditioner_;
  IterativeOptions options_;
  ChunkedSums sums_;
  mutable std::atomic<double> residual_ = 0;
  mutable std::atomic<int> iterations_ = 0;
};

// Conjugate gradients for K e = r until the recursive residual is at the target; x += e. Returns the
// iterations, r is used up. Stops early when the numbers no longer are.
int IterativeSolver::reduce(Vector& r, double target, int iterations, Vector& x) const {
  Vector z(k_.size()), p(k_.size(), 0.0), q(k_.size());
  double rz = 0;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    preconditioner_.apply(r, z, options_.parallel);
    const double next = sums_.dot(r, z);
    const double beta = iteration == 0 ? 0.0 : next / rz;
    rz = next;
    sums_.in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) p[i] = z[i] + beta * p[i];
    });
    k_.apply(p, q, options_.parallel);
    const double alpha = rz / sums_.dot(p, q);
    if (!std::isfinite(alpha) || !(alpha > 0)) return iteration + 1;
    sums_.in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) x[i] += alpha * p[i];
      for (std::size_t i = first; i < last; ++i) r[i] -= alpha * q[i];
    });
    if (sums_.norm(r) <= target) return iteration + 1;
  }
  return iterations;
}

Result<IterativeSolver::Report> IterativeSolver::solve_column(std::span<const double> f,
                                                              std::span<double> x_out) const {
  Report report;
  const double size = sums_.norm(f);
  if (!std::isfinite(size))
    return make_error(ErrorCode::invalid_argument, "found numbers too large to square", "f");
  Vector x(k_.size(), 0.0), r(f.begin(), f.end()), product(k_.size());
  double residual = size;
  const double target = options_.relative_residual * size;
  for (int restart = 0; restart < max_restarts && residual > target; ++restart) {
    if (report.iterations >= options_.max_iterations) break;
    const Vector before = x;
    // A little deeper than asked, so that rounding seldom asks for another start.
    report.iterations += reduce(r, 0.5 * target, options_.max_iterations - report.iterations, x);
    k_.apply(x, product, options_.parallel);
    sums_.in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) r[i] = f[i] - product[i];
    });
    const double now = sums_.norm(r);
    if (!(now < residual)) {  // Worse, or no number: the last was the best.
      x = before;
      break;
    }
    const bool pays = now < 0.5 * residual;
    residual = now;
    if (residual <= target || !pays || residual <= rounding(k_, x, options_.parallel)) break;
  }
  report.relative_residual = size > 0 ? residual / size : 0.0;
  if (residual > std::max(target, options_.acceptable_residual * size) &&
      !(residual <= rounding_units * rounding(k_, x, options_.parallel)))
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("found a residual of {:.3g} after {} iterations, expected {:.3g}: does anything "
                    "hold the surface?",
                    report.relative_residual, report.iterations, options_.relative_residual),
        "f");
  std::copy(x.begin(), x.end(), x_out.begin());
  return report;
}

Result<Eigen::MatrixXd> IterativeSolver::solve(const Eigen::MatrixXd& f) const {
  if (f.rows() != size())
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} rows, expected {}", f.rows(), size()), "f");
  if (!f.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "f");
  Eigen::MatrixXd x(f.rows(), f.cols());
  Report all;
  for (Eigen::Index column = 0; column < f.cols(); ++column) {
    const Result<Report> report =
        solve_column({f.col(column).data(), k_.size()}, {x.col(column).data(), k_.size()});
    if (!report) return report.error();
    all.relative_residual = std::max(all.relative_residual, report->relative_residual);
    all.iterations = std::max(all.iterations, report->iterations);
  }
  residual_ = all.relative_residual;
  iterations_ = all.iterations;
  return x;
}

}  // namespace

double rounding(const StiffnessOperator& k, std::span<const double> x, const ParallelFor& parallel) {
  Vector size(x.size()), product(x.size());
  std::transform(x.begin(), x.end(), size.begin(), [](double value) { return std::abs(value); });
  k.absolute().apply(size, product, parallel);
  return std::numeric_limits<double>::epsilon() * ChunkedSums(x.size(), parallel).norm(product);
}

Result<IterationParts> iteration_parts(const StiffnessProblem& problem,
                                       const std::vector<std::uint32_t>& tied,
                                       const IterativeOptions& options) {
  if (const Status status = check(problem.energy); !status) return status.error();
  if (!(options.relative_residual > 0 && options.relative_residual < 1))
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 0..1", options.relative_residual), "relative_residual");
  if (options.max_iterations < 1)
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1 or more", options.max_iterations), "max_iterations");
  std::vector<std::uint32_t> points = unknowns(problem);
  if (points.empty())
    return make_error(ErrorCode::invalid_argument, "found no control point that may move, expected some",
                      "supports");
  UnknownGrid grid = grid_of(points, problem.v);
  if (!grid.full)
    return make_error(ErrorCode::unsupported,
                      fmt::format("found {} held control points that leave no full grid of rows by columns, "
                                  "expected those outside of regions",
                                  problem.held.size()),
                      "held");
  if (!problem.grounded.empty() && !(problem.ground_stiffness > 0 && std::isfinite(problem.ground_stiffness)))
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected a positive number", problem.ground_stiffness),
                      "ground_stiffness");
  std::vector<StiffnessOperator::Tie> all, kept;
  for (std::size_t i = 0; i < problem.grounded.size(); ++i) {
    const auto at = std::lower_bound(points.begin(), points.end(), problem.grounded[i]);
    if (at == points.end() || *at != problem.grounded[i] ||
        (i > 0 && problem.grounded[i] <= problem.grounded[i - 1]))
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found point {}, expected ascending ones that may move", problem.grounded[i]),
          fmt::format("grounded[{}]", i));
    all.push_back({static_cast<std::size_t>(at - points.begin()), problem.ground_stiffness});
    if (std::find(tied.begin(), tied.end(), problem.grounded[i]) != tied.end()) kept.push_back(all.back());
  }
  const StiffnessAxis u = stiffness_axis(problem.u, grid.rows);
  const StiffnessAxis v = stiffness_axis(problem.v, grid.columns);
  // Each side that is not free holds at least the mean of the surface.
  const auto loose = [](const KnotVector& knots, const StiffnessAxis& axis) {
    return axis.free_sides == 2 ||
           (knots.is_periodic() && axis.size() == static_cast<std::size_t>(knots.control_count()));
  };
  if (loose(problem.u, u) && loose(problem.v, v) && all.empty())
    return make_error(ErrorCode::failed_precondition,
                      "found nothing that holds the surface, expected a support or grounded control points",
                      "supports");
  Result<ModePreconditioner> preconditioner =
      ModePreconditioner::create(u, v, problem.energy, all, options.parallel);
  if (!preconditioner) return preconditioner.error();
  return IterationParts{std::move(points), StiffnessOperator(u, v, problem.energy, std::move(kept)),
                        std::move(*preconditioner)};
}

Result<std::unique_ptr<StiffnessSolver>> make_iterative_solver(const StiffnessProblem& problem,
                                                               const IterativeOptions& options) {
  try {
    Result<IterationParts> parts = iteration_parts(problem, problem.grounded, options);
    if (!parts) return parts.error();
    return std::unique_ptr<StiffnessSolver>(
        std::make_unique<IterativeSolver>(std::move(parts->k), std::move(parts->preconditioner), options));
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::resource_exhausted, "no memory for a surface this large", "surface");
  }
}

Result<std::unique_ptr<StiffnessSolver>> make_stiffness_solver(const StiffnessProblem& problem,
                                                               const IterativeOptions& options) {
  if (unknowns(problem).size() <= std::min(options.direct_unknowns, max_direct_unknowns))
    return make_direct_solver(problem);
  return make_iterative_solver(problem, options);
}

}  // namespace handloft::geometry
