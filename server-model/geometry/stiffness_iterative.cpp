// The iterative solver of stiffness_solver.h: conjugate gradients (Hestenes and Stiefel 1952) with the
// preconditioner of mode_preconditioner.h, restarted from the true residual as often as that pays.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <new>

#include "server-model/geometry/mode_preconditioner.h"
#include "server-model/geometry/stiffness_solver.h"

namespace handloft::geometry {

namespace {

constexpr std::size_t chunk = 16384;  ///< Numbers a task of a vector's sums; sums are added chunk by chunk.
constexpr int max_restarts = 6;
/// Where restarts no longer help, the residual is rounding when it is below this many units of it.
constexpr double rounding_units = 32;

using Vector = std::vector<double>;

class IterativeSolver final : public StiffnessSolver {
 public:
  IterativeSolver(StiffnessOperator k, ModePreconditioner preconditioner, const IterativeOptions& options)
      : k_(std::move(k)), preconditioner_(std::move(preconditioner)), options_(options) {}

  Eigen::Index size() const override { return static_cast<Eigen::Index>(k_.size()); }
  Result<Eigen::MatrixXd> solve(const Eigen::MatrixXd& f) const override;
  Report report() const override { return {residual_, iterations_}; }

 private:
  Result<Report> solve_column(std::span<const double> f, std::span<double> x) const;
  int reduce(Vector& r, double target, int iterations, Vector& x) const;
  template <typename Task>
  void in_chunks(const Task& task) const;
  template <typename Term>
  double sum(const Term& term) const;
  double norm(std::span<const double> a) const {
    return std::sqrt(sum([&](std::size_t i) { return a[i] * a[i]; }));
  }
  double rounding(std::span<const double> x) const;

  StiffnessOperator k_;
  ModePreconditioner preconditioner_;
  IterativeOptions options_;
  mutable std::atomic<double> residual_ = 0;
  mutable std::atomic<int> iterations_ = 0;
};

template <typename Task>
void IterativeSolver::in_chunks(const Task& task) const {
  const std::size_t n = k_.size();
  options_.parallel((n + chunk - 1) / chunk,
                    [&](std::size_t index) { task(index, index * chunk, std::min(n, (index + 1) * chunk)); });
}

// Eight sums side by side in each chunk: the order of additions depends on the number of unknowns alone.
template <typename Term>
double IterativeSolver::sum(const Term& term) const {
  Vector parts((k_.size() + chunk - 1) / chunk);
  in_chunks([&](std::size_t index, std::size_t first, std::size_t last) {
    Lanes sums;
    std::size_t i = first;
    for (; i + panel_lanes <= last; i += panel_lanes)
      for (std::size_t l = 0; l < panel_lanes; ++l) sums.v[l] += term(i + l);
    for (; i < last; ++i) sums.v[0] += term(i);
    for (const double part : sums.v) parts[index] += part;
  });
  double total = 0;
  for (const double part : parts) total += part;
  return total;
}

// What rounding alone may leave of f - K x: the spacing of doubles times |K| |x|.
double IterativeSolver::rounding(std::span<const double> x) const {
  Vector size(x.size()), product(x.size());
  std::transform(x.begin(), x.end(), size.begin(), [](double value) { return std::abs(value); });
  k_.absolute().apply(size, product, options_.parallel);
  return std::numeric_limits<double>::epsilon() * norm(product);
}

// Conjugate gradients for K e = r until the recursive residual is at the target; x += e. Returns the
// iterations, r is used up. Stops early when the numbers no longer are.
int IterativeSolver::reduce(Vector& r, double target, int iterations, Vector& x) const {
  Vector z(k_.size()), p(k_.size(), 0.0), q(k_.size());
  double rz = 0;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    preconditioner_.apply(r, z, options_.parallel);
    const double next = sum([&](std::size_t i) { return r[i] * z[i]; });
    const double beta = iteration == 0 ? 0.0 : next / rz;
    rz = next;
    in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) p[i] = z[i] + beta * p[i];
    });
    k_.apply(p, q, options_.parallel);
    const double alpha = rz / sum([&](std::size_t i) { return p[i] * q[i]; });
    if (!std::isfinite(alpha) || !(alpha > 0)) return iteration + 1;
    in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) x[i] += alpha * p[i];
      for (std::size_t i = first; i < last; ++i) r[i] -= alpha * q[i];
    });
    if (norm(r) <= target) return iteration + 1;
  }
  return iterations;
}

Result<IterativeSolver::Report> IterativeSolver::solve_column(std::span<const double> f,
                                                              std::span<double> x_out) const {
  Report report;
  const double size = norm(f);
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
    in_chunks([&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) r[i] = f[i] - product[i];
    });
    const double now = norm(r);
    if (!(now < residual)) {  // Worse, or no number: the last was the best.
      x = before;
      break;
    }
    const bool pays = now < 0.5 * residual;
    residual = now;
    if (residual <= target || !pays || residual <= rounding(x)) break;
  }
  report.relative_residual = size > 0 ? residual / size : 0.0;
  if (residual > target && !(residual <= rounding_units * rounding(x)))
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

Result<std::unique_ptr<StiffnessSolver>> make_iterative_solver(const StiffnessProblem& problem,
                                                               const IterativeOptions& options) {
  if (const Status status = check(problem.energy); !status) return status.error();
  if (!problem.held.empty())
    return make_error(ErrorCode::unsupported,
                      fmt::format("found {} held control points, expected none on a surface this large",
                                  problem.held.size()),
                      "held");
  if (!(options.relative_residual > 0 && options.relative_residual < 1))
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 0..1", options.relative_residual), "relative_residual");
  if (options.max_iterations < 1)
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1 or more", options.max_iterations), "max_iterations");
  try {
    const std::vector<std::uint32_t> points = movable_points(problem.u, problem.v, problem.supports);
    if (points.empty())
      return make_error(ErrorCode::invalid_argument, "found no control point that may move, expected some",
                        "supports");
    std::vector<StiffnessOperator::Tie> ties;
    if (!problem.grounded.empty() &&
        !(problem.ground_stiffness > 0 && std::isfinite(problem.ground_stiffness)))
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected a positive number", problem.ground_stiffness),
                        "ground_stiffness");
    for (std::size_t i = 0; i < problem.grounded.size(); ++i) {
      const auto at = std::lower_bound(points.begin(), points.end(), problem.grounded[i]);
      if (at == points.end() || *at != problem.grounded[i] ||
          (i > 0 && problem.grounded[i] <= problem.grounded[i - 1]))
        return make_error(
            ErrorCode::invalid_argument,
            fmt::format("found point {}, expected ascending ones that may move", problem.grounded[i]),
            fmt::format("grounded[{}]", i));
      ties.push_back({static_cast<std::size_t>(at - points.begin()), problem.ground_stiffness});
    }
    const SculptSupports& supports = problem.supports;
    const StiffnessAxis u = stiffness_axis(problem.u, supports.u_lower, supports.u_upper);
    const StiffnessAxis v = stiffness_axis(problem.v, supports.v_lower, supports.v_upper);
    // Each side that is not free holds at least the mean of the surface.
    const bool loose =
        (problem.u.is_periodic() || u.free_sides == 2) && (problem.v.is_periodic() || v.free_sides == 2);
    if (loose && ties.empty())
      return make_error(ErrorCode::failed_precondition,
                        "found nothing that holds the surface, expected a support or grounded control points",
                        "supports");
    Result<ModePreconditioner> preconditioner =
        ModePreconditioner::create(u, v, problem.energy, ties, options.parallel);
    if (!preconditioner) return preconditioner.error();
    StiffnessOperator k(u, v, problem.energy, std::move(ties));
    return std::unique_ptr<StiffnessSolver>(
        std::make_unique<IterativeSolver>(std::move(k), std::move(*preconditioner), options));
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::resource_exhausted, "no memory for a surface this large", "surface");
  }
}

Result<std::unique_ptr<StiffnessSolver>> make_stiffness_solver(const StiffnessProblem& problem,
                                                               const IterativeOptions& options) {
  const auto size = static_cast<std::size_t>(problem.u.control_count()) *
                    static_cast<std::size_t>(problem.v.control_count());
  if (size <= max_direct_unknowns || !problem.held.empty()) return make_direct_solver(problem);
  return make_iterative_solver(problem, options);
}

}  // namespace handloft::geometry
