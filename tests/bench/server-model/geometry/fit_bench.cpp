// A27: a fit of 1,000 points <= 1 ms and of 100,000 points, N = 2, <= 10 ms, never slower than Eigen's
// ColPivHouseholderQR on the raw matrix; adding and removing a point in O(p^2), <= 20 microseconds at any
// size. Baselines in the same run: that QR (with and without the time to write the matrix down) and raw
// normal equations by Cholesky, the cheapest method there is, which loses every digit on hard data (see
// nist_bench.cpp).

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>
#include <string>
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

/// Processor time of this thread, so that others on the machine hardly show as slow additions. What the
/// kernel does meanwhile (interrupts, faults) counts.
double thread_microseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

template <typename Work>
double timed(const Work& work) {
  const double begin = thread_microseconds();
  work();
  return thread_microseconds() - begin;
}

/// Arithmetic that touches no memory: what is slow about it is the machine's doing.
double spin(int steps, double x) {
  for (int i = 0; i < steps; ++i) x = x * 0.999999 + 1e-7;
  return x;
}

/// So many steps take as long, on the whole, as `microseconds`.
int steps_that_take(double microseconds) {
  constexpr int steps = 10'000'000;
  return static_cast<int>(steps * microseconds / timed([] { benchmark::DoNotOptimize(spin(steps, 1)); }));
}

constexpr double budget_us = 20;

void report_times(benchmark::State& state, const std::string& name, std::vector<double> times) {
  double sum = 0;
  for (const double t : times) sum += t;
  std::sort(times.begin(), times.end());
  const std::size_t n = times.size();
  const auto late = times.end() - std::upper_bound(times.begin(), times.end(), budget_us);
  state.counters[name + "mean_us"] = sum / static_cast<double>(n);
  state.counters[name + "p99.99_us"] = times[n - 1 - n / 10000];
  state.counters[name + "worst_us"] = times.back();
  state.counters[name + "over_20us"] = static_cast<double>(late);
}

/// The i-th of n points on a spiral that starts with 0.1 mm and grows a thousandfold, so that the box grows
/// on the way.
WeightedPoint on_spiral(std::size_t i, std::size_t n) {
  const double radius = 1e-4 * std::pow(1000.0, static_cast<double>(i) / static_cast<double>(n));
  const double angle = 0.7 * static_cast<double>(i);
  return {{radius * std::cos(angle), radius * std::sin(angle), 0.01 * std::sin(3 * angle)}, 0.5};
}

/// Every one of n additions timed by itself; among them are those that need new memory or let the box grow.
/// After each follows the baseline, also timed by itself: as long a piece of arithmetic in registers. What
/// interrupts and the hypervisor do to the one they do to the other, so a tail that the baseline has too is
/// not the fitter's. The same additions are made several times; `again_worst_us` is the worst of each
/// addition's best time: what is slow of itself is slow every time.
void live_add_each(benchmark::State& state) {
  constexpr int runs = 5;
  const auto n = static_cast<std::size_t>(state.range(0));
  const FitOptions options{.degree = static_cast<int>(state.range(1))};
  std::vector<double> times(n), baseline(n), best(n);
  std::size_t growths = 0;
  rusage before{}, after{};
  for (auto _ : state) {
    PolynomialFitter first(options);
    constexpr std::size_t few = 20000;
    const double all_us = timed([&] {
      for (std::size_t i = 0; i < few; ++i) benchmark::DoNotOptimize(first.add(on_spiral(i, few)));
    });
    const double points_us = timed([&] {
      for (std::size_t i = 0; i < few; ++i) benchmark::DoNotOptimize(on_spiral(i, few));
    });
    const int steps = steps_that_take((all_us - points_us) / few);
    std::vector<PolynomialFitter> fitters;  // All kept, so that each takes memory that nobody used before.
    fitters.reserve(runs);
    getrusage(RUSAGE_SELF, &before);
    for (int run = 0; run < runs; ++run) {
      PolynomialFitter& fitter = fitters.emplace_back(options);
      for (std::size_t i = 0; i < n; ++i) {
        const WeightedPoint point = on_spiral(i, n);
        times[i] = timed([&] { benchmark::DoNotOptimize(fitter.add(point)); });
        baseline[i] = timed([&] { benchmark::DoNotOptimize(spin(steps, 1)); });
        best[i] = run == 0 ? times[i] : std::min(best[i], times[i]);
      }
      growths = fitter.growths();
    }
    getrusage(RUSAGE_SELF, &after);
  }
  report_times(state, "", times);
  report_times(state, "baseline_", baseline);
  state.counters["again_worst_us"] = *std::max_element(best.begin(), best.end());
  state.counters["growths"] = static_cast<double>(growths);
  state.counters["faults"] = static_cast<double>(after.ru_minflt - before.ru_minflt);
  state.counters["preempted"] = static_cast<double>(after.ru_nivcsw - before.ru_nivcsw);
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
