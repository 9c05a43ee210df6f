// Sculpting at the sizes of the paper's table 2, with 32 point constraints (D21): what a setup, an icon more
// or less and a frame of a drag cost, beside a frame that keeps nothing (K factorised each time) and one that
// keeps Eigen's factor of K with the constraints as springs and solves once for x, y and z.

#include <benchmark/benchmark.h>

#include <Eigen/SparseCholesky>
#include <cmath>
#include <vector>

#include "server-model/geometry/sculpt_system.h"

namespace handloft::geometry {
namespace {

constexpr int constraints = 32;
constexpr int dragged = 16;

BSplineSurface sheet(const benchmark::State& state) {
  BSplineSurface surface{KnotVector::uniform(3, static_cast<int>(state.range(0))).value(),
                         KnotVector::uniform(3, static_cast<int>(state.range(1))).value(),
                         {},
                         {}};
  for (int i = 0; i < surface.u.control_count(); ++i)
    for (int j = 0; j < surface.v.control_count(); ++j) {
      const double u = surface.u.greville(i);
      const double v = surface.v.greville(j);
      surface.control.emplace_back(1.5 * u, v, 0.1 * std::sin(3 * u) * std::cos(2 * v));
    }
  return surface;
}

// Spread evenly but on no grid: multiples of the golden ratio.
Vec2 place(int i) {
  return {std::fmod(0.618034 * (i + 1), 1) * 0.9 + 0.05, (i + 0.5) / (constraints + 1)};
}

SculptRow row(const BSplineSurface& surface, const Vec2& uv) {
  return point_row(surface, uv, PointAspect::position, surface.evaluate(uv.x(), uv.y())).value();
}

std::vector<SculptRow> rows(const BSplineSurface& surface) {
  std::vector<SculptRow> all;
  for (int i = 0; i < constraints; ++i) all.push_back(row(surface, place(i)));
  return all;
}

void sizes(benchmark::internal::Benchmark* bench) {
  bench->Args({15, 20})->Args({32, 38})->Args({40, 42})->Args({54, 91})->Args({159, 81});
  bench->Unit(benchmark::kMillisecond);
}

void setup(benchmark::State& state) {
  const BSplineSurface surface = sheet(state);
  const std::vector<SculptRow> all = rows(surface);
  for (auto _ : state) {
    SculptSystem system = SculptSystem::create(surface, {}).value();
    benchmark::DoNotOptimize(system.solve(all, {}, ConflictPolicy::refuse).value());
  }
}
BENCHMARK(setup)->Apply(sizes);

// An icon more, to the first shape with it: each time another place, which nothing is known of.
void add_icon(benchmark::State& state) {
  const BSplineSurface surface = sheet(state);
  std::vector<SculptRow> all = rows(surface);
  SculptSystem system = SculptSystem::create(surface, {}).value();
  benchmark::DoNotOptimize(system.solve(all, {}, ConflictPolicy::refuse).value());
  all.push_back(all.back());
  double next = 0;
  for (auto _ : state) {
    next += 1;
    all.back() =
        row(surface, {std::fmod(0.754878 * next, 1) * 0.9 + 0.05, std::fmod(0.56984 * next, 1) * 0.9 + 0.05});
    benchmark::DoNotOptimize(system.solve(all, {}, ConflictPolicy::refuse).value());
  }
}
BENCHMARK(add_icon)->Apply(sizes);

void remove_icon(benchmark::State& state) {
  const BSplineSurface surface = sheet(state);
  const std::vector<SculptRow> all = rows(surface);
  SculptSystem system = SculptSystem::create(surface, {}).value();
  const std::vector<SculptRow> fewer(all.begin(), all.end() - 1);
  for (auto _ : state) {
    state.PauseTiming();
    benchmark::DoNotOptimize(system.solve(all, {}, ConflictPolicy::refuse).value());
    state.ResumeTiming();
    benchmark::DoNotOptimize(system.solve(fewer, {}, ConflictPolicy::refuse).value());
  }
}
BENCHMARK(remove_icon)->Apply(sizes);

void drag_frame(benchmark::State& state) {
  const BSplineSurface surface = sheet(state);
  std::vector<SculptRow> all = rows(surface);
  SculptSystem system = SculptSystem::create(surface, {}).value();
  for (auto _ : state) {
    all[dragged].target += Vec3(0, 1e-5, 1e-4);
    benchmark::DoNotOptimize(system.solve(all, {}, ConflictPolicy::refuse).value());
  }
  const SculptSolution last = system.solve(all, {}, ConflictPolicy::refuse).value();
  const SculptResidual residual = system.residual(all, {}, last);
  state.counters["stationarity"] = residual.stationarity;
  state.counters["constraints"] = residual.constraints;
}
BENCHMARK(drag_frame)->Apply(sizes);

void drag_frame_refactoring(benchmark::State& state) {
  const BSplineSurface surface = sheet(state);
  std::vector<SculptRow> all = rows(surface);
  for (auto _ : state) {
    all[dragged].target += Vec3(0, 1e-5, 1e-4);
    SculptSystem system = SculptSystem::create(surface, {}).value();
    benchmark::DoNotOptimize(system.solve(all, {}, ConflictPolicy::refuse).value());
  }
}
BENCHMARK(drag_frame_refactoring)->Apply(sizes);

// Springs as constraints are the usual shortcut; they are met but roughly.
void drag_frame_simplicial_ldlt(benchmark::State& state) {
  const BSplineSurface surface = sheet(state);
  std::vector<SculptRow> all = rows(surface);
  const std::vector<std::uint32_t> movable = movable_points(surface.u, surface.v, {});
  std::vector<Eigen::Index> at(surface.control.size(), -1);
  for (std::size_t i = 0; i < movable.size(); ++i) at[movable[i]] = static_cast<Eigen::Index>(i);
  Eigen::SparseMatrix<double> k = principal_part(stiffness(surface.u, surface.v, {}), movable);
  constexpr double spring = 1e6;
  std::vector<Eigen::Triplet<double>> springs;
  for (const SculptRow& one : all)
    for (std::size_t a = 0; a < one.functional.point.size(); ++a)
      for (std::size_t b = 0; b < one.functional.point.size(); ++b)
        if (at[one.functional.point[a]] >= 0 && at[one.functional.point[b]] >= 0)
          springs.emplace_back(at[one.functional.point[a]], at[one.functional.point[b]],
                               spring * one.functional.value[a] * one.functional.value[b]);
  Eigen::SparseMatrix<double> held(k.rows(), k.cols());
  held.setFromTriplets(springs.begin(), springs.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(k + held);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(k.rows(), 3);
  for (auto _ : state) {
    for (std::size_t a = 0; a < all[dragged].functional.point.size(); ++a)
      if (at[all[dragged].functional.point[a]] >= 0)
        right.row(at[all[dragged].functional.point[a]]) +=
            spring * all[dragged].functional.value[a] * Eigen::RowVector3d(0, 1e-5, 1e-4);
    const Eigen::MatrixXd displacement = factor.solve(right);
    benchmark::DoNotOptimize(displacement.data());
  }
}
BENCHMARK(drag_frame_simplicial_ldlt)->Apply(sizes);

}  // namespace
}  // namespace handloft::geometry
