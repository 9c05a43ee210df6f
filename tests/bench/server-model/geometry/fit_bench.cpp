// A27: a fit of 1,000 points <= 1 ms and of 100,000 points, N = 2, <= 10 ms, never slower than Eigen's
// ColPivHouseholderQR on the raw matrix; adding and removing a point in O(p^2), <= 20 microseconds at any
// size. Baselines in the same run: that QR (with and without the time to write the matrix down) and raw
// normal equations by Cholesky, the cheapest method there is, which loses every digit on hard data (see
// nist_bench.cpp).

#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>
#include <vector>

#include "server-model/geometry/automatic_degree.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/polynomial_fitter.h"

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

/// (points, degree), where there are more points than coefficients.
void every_size(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"points", "degree"})->Unit(benchmark::kMicrosecond);
  for (const int points : {30, 100, 1000, 10000, 100000}) {
    for (const int degree : {1, 2, 3, 4, 6}) {
      if (points > coefficient_count(degree)) benchmark->Args({points, degree});
    }
  }
}

void fit(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  const FitOptions options{.degree = static_cast<int>(state.range(1))};
  for (auto _ : state) benchmark::DoNotOptimize(fit_polynomial_surface(points, options));
}
BENCHMARK(fit)->Apply(every_size);

/// sqrt(theta) * [monomials of metres | z]
void raw_matrix(const std::vector<WeightedPoint>& points, int degree, Eigen::MatrixXd& a,
                Eigen::VectorXd& b) {
  const int p = coefficient_count(degree);
  a.resize(static_cast<Eigen::Index>(points.size()), p);
  b.resize(a.rows());
  std::vector<double> row(static_cast<std::size_t>(p));
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const WeightedPoint& point = points[static_cast<std::size_t>(i)];
    const double root = std::sqrt(point.weight);
    evaluate_monomials(degree, point.position.x(), point.position.y(), row.data());
    for (int k = 0; k < p; ++k) a(i, k) = root * row[static_cast<std::size_t>(k)];
    b[i] = root * point.position.z();
  }
}

void baseline_colpiv_qr(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  for (auto _ : state) {
    raw_matrix(points, static_cast<int>(state.range(1)), a, b);
    benchmark::DoNotOptimize(Eigen::VectorXd(a.colPivHouseholderQr().solve(b)));
  }
}
BENCHMARK(baseline_colpiv_qr)->Apply(every_size);

void baseline_colpiv_qr_of_given_matrix(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  raw_matrix(points, static_cast<int>(state.range(1)), a, b);
  for (auto _ : state) benchmark::DoNotOptimize(Eigen::VectorXd(a.colPivHouseholderQr().solve(b)));
}
BENCHMARK(baseline_colpiv_qr_of_given_matrix)->Apply(every_size);

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
BENCHMARK(baseline_normal_equations)->Apply(every_size);

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

/// Processor time of this thread, so that others on the machine don't show as slow additions.
double thread_microseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

/// Every one of n additions timed by itself: a spiral that starts with 0.1 mm and grows a thousandfold, so
/// that the box grows on the way. Among `worst_us` are new chunks of memory and growth of the box.
void live_add_each(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  std::vector<double> times(n);
  std::size_t growths = 0;
  for (auto _ : state) {
    PolynomialFitter fitter({.degree = static_cast<int>(state.range(1))});
    for (std::size_t i = 0; i < n; ++i) {
      const double radius = 1e-4 * std::pow(1000.0, static_cast<double>(i) / static_cast<double>(n));
      const double angle = 0.7 * static_cast<double>(i);
      const WeightedPoint point{
          {radius * std::cos(angle), radius * std::sin(angle), 0.01 * std::sin(3 * angle)}, 0.5};
      const double begin = thread_microseconds();
      benchmark::DoNotOptimize(fitter.add(point));
      times[i] = thread_microseconds() - begin;
    }
    growths = fitter.growths();
  }
  double sum = 0;
  for (const double t : times) sum += t;
  std::sort(times.begin(), times.end());
  state.counters["mean_us"] = sum / static_cast<double>(n);
  state.counters["p99.99_us"] = times[n - 1 - n / 10000];
  state.counters["worst_us"] = times.back();
  state.counters["growths"] = static_cast<double>(growths);
}
BENCHMARK(live_add_each)
    ->ArgNames({"points", "degree"})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1)
    ->Args({1000000, 2})
    ->Args({1000000, 4})
    ->Args({1000000, 6});

/// The whole decision, one QR and one pass for all six degrees, beside a single fit of degree 6.
void automatic_degree(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(fit_automatic_degree(points));
}
BENCHMARK(automatic_degree)->Unit(benchmark::kMicrosecond)->Arg(1000)->Arg(10000)->Arg(100000);

}  // namespace
}  // namespace handloft::geometry
