// A27: a fit of 1,000 points <= 1 ms and of 100,000 points, N = 2, <= 10 ms; adding and removing a point in
// O(p^2). The baseline in the same run is the cheapest method there is, raw normal equations by Cholesky,
// which loses every digit on hard data (see geometry_nist_test.cpp).

#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <random>
#include <vector>

#include "server-model/geometry/polynomial_fit.h"

namespace handloft::geometry {
namespace {

std::vector<WeightedPoint> cloud(std::size_t n) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<WeightedPoint> points(n);
  for (WeightedPoint& p : points) {
    p.position = {0.08 * unit(random), 0.05 * unit(random), 0.01 * unit(random)};
    p.weight = 0.55 + 0.45 * unit(random);
  }
  return points;
}

void fit(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  const FitOptions options{.degree = static_cast<int>(state.range(1))};
  for (auto _ : state) benchmark::DoNotOptimize(fit_polynomial_surface(points, options));
}
BENCHMARK(fit)
    ->ArgNames({"points", "degree"})
    ->Unit(benchmark::kMillisecond)
    ->Args({1000, 2})
    ->Args({1000, 4})
    ->Args({10000, 2})
    ->Args({100000, 2})
    ->Args({100000, 4});

void baseline_normal_equations(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  const int degree = static_cast<int>(state.range(1));
  const int p = coefficient_count(degree);
  for (auto _ : state) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(p, p);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(p);
    Eigen::VectorXd row(p);
    for (const WeightedPoint& point : points) {
      evaluate_monomials(degree, point.position.x(), point.position.y(), row.data());
      for (int j = 0; j < p; ++j) {
        const double weighted = point.weight * row[j];
        right[j] += weighted * point.position.z();
        for (int i = j; i < p; ++i) normal(i, j) += weighted * row[i];
      }
    }
    benchmark::DoNotOptimize(Eigen::VectorXd(normal.llt().solve(right)));
  }
}
BENCHMARK(baseline_normal_equations)
    ->ArgNames({"points", "degree"})
    ->Unit(benchmark::kMillisecond)
    ->Args({1000, 2})
    ->Args({100000, 2})
    ->Args({100000, 4});

void live_add_solve_remove(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  PolynomialFitter fitter({.degree = static_cast<int>(state.range(1))});
  (void)fitter.add(points).ok();
  for (auto _ : state) {
    const auto slot = fitter.add(WeightedPoint{{0.01, 0.02, 0.003}, 0.5});
    benchmark::DoNotOptimize(fitter.solve());
    (void)fitter.remove(*slot).ok();
  }
  state.counters["refactorisations"] = static_cast<double>(fitter.refactorisations());
}
BENCHMARK(live_add_solve_remove)
    ->ArgNames({"points", "degree"})
    ->Unit(benchmark::kMicrosecond)
    ->Args({1000, 2})
    ->Args({100000, 2})
    ->Args({100000, 6});

}  // namespace
}  // namespace handloft::geometry
