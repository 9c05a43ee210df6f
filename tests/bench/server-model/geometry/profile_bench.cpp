// A19: what drawing a profile costs, by the number of points. 10,000 points must take <= 5 ms in the model
// (see bench_model_document); here are the parts. The baseline is the paper's recipe taken literally: Eigen's
// ColPivHouseholderQR of the 2 n rows of originals and temporaries, in raw monomials.

#include <benchmark/benchmark.h>

#include <Eigen/QR>
#include <cmath>
#include <random>
#include <vector>

#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/profile_modification.h"
#include "server-model/geometry/residual_matching.h"
#include "server-model/geometry/stroke_partition.h"

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

/// Two strokes of 200 points: 2 s of drawing at 90 Hz each.
std::vector<Curve> strokes() {
  std::vector<Curve> result(2);
  for (int i = 0; i < 200; ++i) {
    const double t = -1 + i / 100.0;
    result[0].push_back({0.08 * t, 0.01 * t * t, 0.03 - 0.02 * t * t});
    result[1].push_back({0.01 * t, 0.05 * t, 0.03 - 0.01 * t * t});
  }
  return result;
}

void sizes(benchmark::internal::Benchmark* b) {
  b->ArgNames({"points", "degree"})->Unit(benchmark::kMillisecond);
  for (const int degree : {2, 3, 4}) b->Args({10000, degree});
  b->Args({1000, 2})->Args({100000, 2});
}

void profile_edit(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  const auto before = fit_polynomial_surface(points, {.degree = static_cast<int>(state.range(1))})->surface;
  const std::vector<Curve> drawn = strokes();
  for (auto _ : state) {
    const auto temporary = points_along(*prepare_strokes(drawn), points.size());
    const auto after = ProfileFitter::create(points, before)->fit_with(*temporary);
    std::vector<WeightedPoint> moved = points;
    match_residuals(*after, vertical_residuals(before, points), moved);
    benchmark::DoNotOptimize(moved);
  }
}
BENCHMARK(profile_edit)->Apply(sizes);

void profile_edit_baseline_literal_recipe(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  const int degree = static_cast<int>(state.range(1));
  const auto before = fit_polynomial_surface(points, {.degree = degree})->surface;
  const std::vector<Curve> drawn = strokes();
  const Eigen::Index p = coefficient_count(degree);
  for (auto _ : state) {
    std::vector<WeightedPoint> all = points;
    const auto temporary = points_along(*prepare_strokes(drawn), points.size());
    for (const Vec3& point : *temporary) all.push_back({point, 1.0});
    Eigen::MatrixXd a(static_cast<Eigen::Index>(all.size()), p);
    Eigen::VectorXd z(a.rows());
    Eigen::VectorXd row(p);
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      const WeightedPoint& point = all[static_cast<std::size_t>(i)];
      const double root = std::sqrt(point.weight);
      evaluate_monomials(degree, point.position.x(), point.position.y(), row.data());
      a.row(i) = root * row.transpose();
      z[i] = root * point.position.z();
    }
    const Eigen::VectorXd c = Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(a).solve(z);
    const auto after = PolynomialSurface::from_coefficients(degree, {c.data(), static_cast<std::size_t>(p)});
    std::vector<WeightedPoint> moved = points;
    match_residuals(*after, vertical_residuals(before, points), moved);
    benchmark::DoNotOptimize(moved);
  }
}
BENCHMARK(profile_edit_baseline_literal_recipe)->Apply(sizes);

/// While the curve is being drawn, the originals stay factored.
void profile_edit_of_a_factored_shape(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  const auto before = fit_polynomial_surface(points, {.degree = static_cast<int>(state.range(1))})->surface;
  const auto fitter = ProfileFitter::create(points, before);
  const std::vector<Curve> drawn = strokes();
  for (auto _ : state) {
    const auto temporary = points_along(*prepare_strokes(drawn), points.size());
    benchmark::DoNotOptimize(fitter->fit_with(*temporary));
  }
}
BENCHMARK(profile_edit_of_a_factored_shape)->Apply(sizes);

/// A8 alone; the baseline is what it spares: a fit of the moved points.
void residual_matching(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  const int degree = static_cast<int>(state.range(1));
  const auto before = fit_polynomial_surface(points, {.degree = degree})->surface;
  const auto after = fit_polynomial_surface(cloud(50), {.degree = degree})->surface;
  for (auto _ : state) {
    std::vector<WeightedPoint> moved = points;
    match_residuals(after, vertical_residuals(before, points), moved);
    benchmark::DoNotOptimize(moved);
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(residual_matching)->Apply(sizes);

void residual_matching_baseline_refit(benchmark::State& state) {
  const std::vector<WeightedPoint> points = cloud(static_cast<std::size_t>(state.range(0)));
  const FitOptions options{.degree = static_cast<int>(state.range(1))};
  for (auto _ : state) benchmark::DoNotOptimize(fit_polynomial_surface(points, options));
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(residual_matching_baseline_refit)->Apply(sizes);

/// A21: a stroke over a row of shapes.
void divide_a_stroke(benchmark::State& state) {
  std::vector<ProfileCandidate> candidates;
  for (int k = 0; k < state.range(0); ++k) {
    ProfileCandidate candidate;
    candidate.frame.origin = {0.1 * k, 0, 0};
    candidate.surface = fit_polynomial_surface(cloud(50))->surface;
    const Superellipse trim = *Superellipse::create({Vec2::Zero(), {0.05, 0.05}}, 2.5);
    candidate.outside_m = [trim](const Vec2& xy) { return distance_outside(trim, xy); };
    candidates.push_back(std::move(candidate));
  }
  Curve stroke;
  const double length = 0.1 * static_cast<double>(state.range(0));
  for (int i = 0; i < 400; ++i) stroke.push_back({length * i / 400.0, 0.01 * std::sin(0.1 * i), 0.01});
  for (auto _ : state) benchmark::DoNotOptimize(divide_stroke(stroke, candidates));
}
BENCHMARK(divide_a_stroke)->ArgName("shapes")->Arg(2)->Arg(20)->Arg(200)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace handloft::geometry
