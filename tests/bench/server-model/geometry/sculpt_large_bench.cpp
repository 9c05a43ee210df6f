// Very large sculpted surfaces: 320 x 320 and 1000 x 1000 control points, bicubic, free at all sides (tied at
// four points) or clamped. What a constraint costs to set up (one solution of K x = phi), and a dragged
// frame: control points x0 + z delta^T and the mesh, on two threads. Baselines in the same run: conjugate
// gradients preconditioned by the usual fast diagonalisation, of the pair (first-derivative Gram, mass), with
// the same product loops; at 320 x 320 Eigen's sparse factor. Counters: iterations; residual, |K x - f| /
// |f|.

#include <benchmark/benchmark.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "server-model/geometry/bspline_grid.h"
#include "server-model/geometry/stiffness_axis.h"
#include "server-model/geometry/stiffness_loops.h"
#include "server-model/geometry/stiffness_solver.h"

namespace handloft::geometry {
namespace {

enum Sides : std::int64_t { free_sides, clamped_sides };
constexpr std::int64_t graded = 10, equal = 1;  // The longest span over the shortest.

void two_threads(std::size_t count, const std::function<void(std::size_t)>& task) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) task(i);
  };
  std::thread other(work);
  work();
  other.join();
}

KnotVector make_knots(int count, double ratio) {
  const int spans = count - 3;
  std::vector<double> ends = {0.0};
  for (int i = 0; i < spans; ++i) ends.push_back(ends.back() + std::pow(ratio, i / (spans - 1.0)));
  for (double& end : ends) end /= ends.back();
  std::vector<double> knots(3, 0.0);
  knots.insert(knots.end(), ends.begin(), ends.end());
  knots.insert(knots.end(), 3, ends.back());
  return KnotVector::open(3, std::move(knots)).value();
}

StiffnessProblem make_problem(std::int64_t n, std::int64_t sides, std::int64_t ratio = equal) {
  const KnotVector knots = make_knots(static_cast<int>(n), static_cast<double>(ratio));
  StiffnessProblem problem{knots, knots, {}, {}};
  if (sides == free_sides) {
    problem.supports = {Support::free, Support::free, Support::free, Support::free};
    const auto count = static_cast<std::uint32_t>(n);
    problem.grounded = {0, count - 1, (count - 1) * count, count * count - 1};
    problem.ground_stiffness = 10;
  }
  return problem;
}

/// The values of the functions at a place off the middle: what a position constraint asks.
Eigen::VectorXd position(const StiffnessProblem& problem) {
  const std::vector<std::uint32_t> points = unknowns(problem);
  const auto columns = static_cast<std::uint32_t>(problem.v.control_count());
  std::array<double, 4> in_u{}, in_v{};
  const int span_u = problem.u.span(0.3731), span_v = problem.v.span(0.6117);
  basis_functions(problem.u, span_u, 0.3731, 0, in_u);
  basis_functions(problem.v, span_v, 0.6117, 0, in_v);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(points.size()));
  for (std::uint32_t i = 0; i < 4; ++i) {
    for (std::uint32_t j = 0; j < 4; ++j) {
      const std::uint32_t point =
          (static_cast<std::uint32_t>(span_u) - 3 + i) * columns + static_cast<std::uint32_t>(span_v) - 3 + j;
      f[std::lower_bound(points.begin(), points.end(), point) - points.begin()] = in_u[i] * in_v[j];
    }
  }
  return f;
}

// Once a surface: Gram matrices, vibrations, factors.
void prepare(benchmark::State& state) {
  const StiffnessProblem problem = make_problem(state.range(0), state.range(1));
  IterativeOptions options;
  options.parallel = two_threads;
  for (auto _ : state) benchmark::DoNotOptimize(make_iterative_solver(problem, options));
}
BENCHMARK(prepare)
    ->ArgNames({"n", "clamped"})
    ->Args({320, free_sides})
    ->Args({1000, free_sides})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// Once a constraint. `digits`: of the residual.
void constraint(benchmark::State& state) {
  const StiffnessProblem problem = make_problem(state.range(0), state.range(1), state.range(2));
  IterativeOptions options;
  options.parallel = two_threads;
  options.relative_residual = std::pow(10, -static_cast<double>(state.range(3)));
  const auto solver = make_iterative_solver(problem, options).value();
  const Eigen::VectorXd f = position(problem);
  for (auto _ : state) {
    const Result<Eigen::MatrixXd> x = solver->solve(f);
    if (!x) state.SkipWithError(x.error().message.c_str());
  }
  state.counters["iterations"] = solver->report().iterations;
  state.counters["residual"] = solver->report().relative_residual;
}
BENCHMARK(constraint)
    ->ArgNames({"n", "clamped", "graded", "digits"})
    ->Args({320, free_sides, equal, 6})
    ->Args({320, free_sides, equal, 8})
    ->Args({320, free_sides, equal, 10})
    ->Args({320, clamped_sides, equal, 10})
    ->Args({320, free_sides, graded, 8})
    ->Args({1000, free_sides, equal, 6})
    ->Args({1000, free_sides, equal, 8})
    ->Args({1000, clamped_sides, equal, 6})
    ->Args({1000, clamped_sides, equal, 8})
    ->Args({1000, free_sides, graded, 6})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// The baseline's preconditioner: with U^T A U diagonal, A and M of the first derivatives and the values,
/// K is about a^2 + 2 a b + b^2 between vibrations a of u and b of v.
class FastDiagonalisation {
 public:
  FastDiagonalisation(const StiffnessProblem& problem, const StiffnessAxis& axis)
      : n_(axis.size()), padded_(n_ + block_columns - n_ % block_columns), reciprocal_(n_ * n_) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(axis.slope.dense(),
                                                                          axis.mass.dense());
    forward_ = in_panels(eigen.eigenvectors().transpose());
    backward_ = in_panels(eigen.eigenvectors());
    for (std::size_t i = 0; i < n_; ++i) {
      for (std::size_t j = 0; j < n_; ++j) {
        const double sum = eigen.eigenvalues()[static_cast<Eigen::Index>(i)] +
                           eigen.eigenvalues()[static_cast<Eigen::Index>(j)];
        // What bends little is held by the ties.
        reciprocal_[i * n_ + j] =
            1 / (sum * sum + problem.energy.a11 * sum + (sum < 1 ? 4 * problem.ground_stiffness : 0.0));
      }
    }
  }

  void apply(const std::vector<double>& r, std::vector<double>& z) const {
    std::vector<double> a(n_ * n_), b(n_ * n_);
    multiply_transposed(forward_, r, a);
    multiply_transposed(forward_, a, b);
    for (std::size_t i = 0; i < b.size(); ++i) b[i] *= reciprocal_[i];
    multiply_transposed(backward_, b, a);
    multiply_transposed(backward_, a, z);
  }

 private:
  std::vector<double> in_panels(const Eigen::MatrixXd& matrix) const {
    std::vector<double> result((n_ + panel_lanes - 1) / panel_lanes * panel_lanes * n_, 0.0);
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t k = 0; k < n_; ++k)
        result[(i / panel_lanes * n_ + k) * panel_lanes + i % panel_lanes] =
            matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
    return result;
  }
  // out = (left in)^T, by columns of `in`.
  void multiply_transposed(const std::vector<double>& left, const std::vector<double>& in,
                           std::vector<double>& out) const {
    two_threads(padded_ / block_columns, [&](std::size_t block) {
      const std::size_t first = block * block_columns;
      constexpr std::size_t depth = 256;
      std::vector<double> packed(depth * block_columns), sums((n_ + panel_lanes) * block_columns, 0.0);
      for (std::size_t k = 0; k < n_; k += depth) {
        const std::size_t step = std::min(depth, n_ - k);
        for (std::size_t row = 0; row < step; ++row)
          for (std::size_t j = 0; j < block_columns; ++j)
            packed[row * block_columns + j] = first + j < n_ ? in[(k + row) * n_ + first + j] : 0.0;
        for (std::size_t i = 0; i < n_; i += panel_lanes)
          stiffness_loops().multiply(left.data() + i * n_ + k * panel_lanes, packed.data(), step,
                                     sums.data() + i * block_columns);
      }
      for (std::size_t j = 0; j < block_columns && first + j < n_; ++j)
        for (std::size_t i = 0; i < n_; ++i)
          out[(first + j) * n_ + i] =
              sums[(i / panel_lanes * block_columns + j) * panel_lanes + i % panel_lanes];
    });
  }

  std::size_t n_, padded_;
  std::vector<double> forward_, backward_, reciprocal_;
};

void baseline_fast_diagonalisation(benchmark::State& state) {
  const StiffnessProblem problem = make_problem(state.range(0), state.range(1));
  const double tolerance = std::pow(10, -static_cast<double>(state.range(2)));
  const StiffnessAxis axis = stiffness_axis(problem.u, problem.supports.u_lower, problem.supports.u_upper);
  std::vector<StiffnessOperator::Tie> ties;
  for (const std::uint32_t point : problem.grounded) ties.push_back({point, problem.ground_stiffness});
  const StiffnessOperator k(axis, axis, problem.energy, ties);
  const FastDiagonalisation preconditioner(problem, axis);
  const Eigen::VectorXd f = position(problem);
  const std::size_t n = k.size();
  using Map = Eigen::Map<Eigen::VectorXd>;
  constexpr int most = 250;  // Free sides need more; `residual` says how far that is.
  int iterations = 0;
  double residual = 0;
  for (auto _ : state) {
    std::vector<double> x(n, 0.0), r(f.data(), f.data() + f.size()), z(n), p(n, 0.0), q(n);
    const auto as_vector = [](std::vector<double>& a) {
      return Map(a.data(), static_cast<Eigen::Index>(a.size()));
    };
    double rz = 0;
    for (iterations = 1; iterations <= most; ++iterations) {
      preconditioner.apply(r, z);
      const double next = as_vector(r).dot(as_vector(z));
      as_vector(p) = as_vector(z) + (iterations == 1 ? 0.0 : next / rz) * as_vector(p);
      rz = next;
      k.apply(p, q, two_threads);
      const double alpha = rz / as_vector(p).dot(as_vector(q));
      as_vector(x) += alpha * as_vector(p);
      as_vector(r) -= alpha * as_vector(q);
      if (as_vector(r).norm() <= tolerance * f.norm()) break;
    }
    k.apply(x, q, two_threads);
    residual = (as_vector(q) - f).norm() / f.norm();
  }
  state.counters["iterations"] = iterations;
  state.counters["residual"] = residual;
}
BENCHMARK(baseline_fast_diagonalisation)
    ->ArgNames({"n", "clamped", "digits"})
    ->Args({320, free_sides, 6})
    ->Args({320, clamped_sides, 6})
    ->Args({1000, free_sides, 6})
    ->Args({1000, clamped_sides, 6})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// The factor, then one solution by it; `deviation` of the iterative solution from it, at the largest.
void baseline_factor(benchmark::State& state) {
  const StiffnessProblem problem = make_problem(state.range(0), free_sides);
  Eigen::SparseMatrix<double> k = stiffness(problem.u, problem.v, problem.energy);
  for (const std::uint32_t point : problem.grounded) k.coeffRef(point, point) += problem.ground_stiffness;
  const Eigen::VectorXd f = position(problem);
  IterativeOptions options;
  options.parallel = two_threads;
  const Eigen::VectorXd found = make_iterative_solver(problem, options).value()->solve(f).value();
  Eigen::VectorXd x;
  double solve_s = 0;
  for (auto _ : state) {
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(k);
    const auto start = std::chrono::steady_clock::now();
    x = factor.solve(f);
    solve_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  state.counters["solve_ms"] = solve_s * 1000;
  state.counters["residual"] = (k * x - f).norm() / f.norm();
  state.counters["deviation"] = (found - x).cwiseAbs().maxCoeff() / x.cwiseAbs().maxCoeff();
}
BENCHMARK(baseline_factor)->ArgNames({"n"})->Arg(320)->Iterations(1)->Unit(benchmark::kMillisecond);

/// A dragged icon on a surface of n x n control points with a mesh of m x m places.
struct Drag {
  BSplineSurface rest;
  std::vector<double> response;  ///< z: of the control points to the icon.
  GridEvaluator mesh;
};
Drag make_drag(std::int64_t n, std::int64_t m) {
  const StiffnessProblem problem = make_problem(n, free_sides);
  IterativeOptions options;
  options.parallel = two_threads;
  options.relative_residual = 1e-6;
  const Eigen::VectorXd z = make_iterative_solver(problem, options).value()->solve(position(problem)).value();
  const auto count = static_cast<int>(n);
  BSplineSurface rest{problem.u, problem.v, {}, {}};
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      rest.control.emplace_back(problem.u.greville(i), problem.v.greville(j),
                                0.1 * std::sin(3.0 * i / count));
  std::vector<double> parameters;
  for (std::int64_t i = 0; i < m; ++i)
    parameters.push_back(static_cast<double>(i) / static_cast<double>(m - 1));
  GridEvaluator mesh(rest, parameters, parameters);
  return {std::move(rest), {z.data(), z.data() + z.size()}, std::move(mesh)};
}

constexpr std::size_t bands = 64;  // Portions of the work of a frame.
template <typename Task>
void in_bands(std::size_t count, const Task& task) {
  two_threads(bands, [&](std::size_t band) { task(band * count / bands, (band + 1) * count / bands); });
}

Vec3 delta_of(int frame) {
  return {0.01 * std::sin(0.1 * frame), 0.002, 0.05 * std::cos(0.1 * frame)};
}

// A frame as it stands: the control points move, and the mesh is evaluated from them.
void drag_evaluate(benchmark::State& state) {
  const Drag drag = make_drag(state.range(0), state.range(1));
  std::vector<double> control(drag.rest.control.size() * 3), places(drag.mesh.size() * 3);
  int frame = 0;
  for (auto _ : state) {
    const Vec3 delta = delta_of(++frame);
    in_bands(drag.rest.control.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i)
        for (std::size_t axis = 0; axis < 3; ++axis)
          control[3 * i + axis] = drag.rest.control[i][static_cast<Eigen::Index>(axis)] +
                                  drag.response[i] * delta[static_cast<Eigen::Index>(axis)];
    });
    in_bands(drag.mesh.rows(), [&](std::size_t first, std::size_t last) {
      const std::size_t columns = 3 * drag.mesh.columns();
      const Status status =
          drag.mesh.evaluate(control, 3, first, last - first,
                             std::span(places).subspan(first * columns, (last - first) * columns));
      benchmark::DoNotOptimize(status);
    });
    benchmark::DoNotOptimize(places.data());
  }
}

// The same with the response evaluated on the mesh when the icon is taken: the mesh, too, is
// m0 + response delta^T, and so are the control points.
void drag_superpose(benchmark::State& state) {
  const Drag drag = make_drag(state.range(0), state.range(1));
  std::vector<Vec3> rest_places;
  (void)drag.mesh.evaluate(drag.rest, rest_places).ok();
  std::vector<double> response(drag.mesh.size());
  (void)drag.mesh.evaluate(drag.response, 1, response).ok();
  std::vector<Vec3> control(drag.rest.control.size()), places(drag.mesh.size());
  int frame = 0;
  for (auto _ : state) {
    const Vec3 delta = delta_of(++frame);
    in_bands(control.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) control[i] = drag.rest.control[i] + drag.response[i] * delta;
    });
    in_bands(places.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) places[i] = rest_places[i] + response[i] * delta;
    });
    benchmark::DoNotOptimize(places.data());
  }
}

void frames(benchmark::internal::Benchmark* b) {
  b->ArgNames({"n", "mesh"})->Args({320, 320})->Args({1000, 500})->Args({1000, 1000});
  b->UseRealTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK(drag_evaluate)->Apply(frames);
BENCHMARK(drag_superpose)->Apply(frames);

}  // namespace
}  // namespace handloft::geometry
