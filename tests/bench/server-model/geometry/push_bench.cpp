// A15-A17: the propagation of a push over 100,000 points with 1,000 contacts, 60 times a second on two cores.
// The baseline in the same run is all pairs, eq. 5 as it stands. `range` is in hundredths of d_max; `error`
// is the largest deviation from all pairs over the largest push, measured outside the timing.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "server-model/geometry/propagation.h"
#include "server-model/geometry/push_solver.h"

namespace handloft::geometry {
namespace {

struct Scene {
  std::vector<Vec3> rest;
  PushSolver solver;
};

// A dome of 0.4 m x 0.3 m with a millimetre of scatter, pushed so that about `contacts` points are met.
Scene make_scene(std::size_t points, std::size_t contacts) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3> rest(points);
  for (Vec3& p : rest) {
    const double x = 0.2 * unit(random), y = 0.15 * unit(random);
    p = {x, y, 0.1 - x * x - 1.5 * y * y + 0.001 * unit(random)};
  }
  const double share = static_cast<double>(contacts) / static_cast<double>(points);
  const double radius = std::sqrt(share * 0.4 * 0.3 / 3.14159265);
  auto solver = PushSolver::create(rest);
  for (const double z : {0.12, 0.10, 0.07}) {
    (void)solver->move_disk({{0.05, 0.02, z}, {0.1, 0, -1}, radius}).ok();
  }
  return {std::move(rest), std::move(*solver)};
}

// Two threads that live as long as the benchmark: what a caller would pass in.
void two_threads(std::size_t count, const std::function<void(std::size_t)>& task) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) task(i);
  };
  std::thread other(work);
  work();
  other.join();
}

double largest_error(const std::vector<Vec3>& a, const std::vector<Vec3>& b, double scale) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, (a[i] - b[i]).norm());
  return worst / scale;
}

void push(benchmark::State& state, const ParallelFor& parallel) {
  const Scene scene = make_scene(static_cast<std::size_t>(state.range(0)), 1000);
  const auto falloff = state.range(2) == 0 ? Falloff::literal : Falloff::smooth;
  const double range = static_cast<double>(state.range(1)) / 100;
  for (auto _ : state) benchmark::DoNotOptimize(scene.solver.displacements(range, falloff, parallel));
  const std::vector<Contact> contacts = scene.solver.contacts();
  const double square = range * range * scene.solver.squared_reach_m2(contacts);
  const PointTree tree(scene.rest, propagation_leaf_size);
  double largest = 0;
  for (const Contact& c : contacts) largest = std::max(largest, c.displacement.norm());
  state.counters["contacts"] = static_cast<double>(contacts.size());
  state.counters["error"] =
      largest_error(propagate(tree, contacts, square, falloff),
                    propagate_all_pairs(scene.rest, contacts, square, falloff), largest);
  state.counters["updates/s"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}

void one_core(benchmark::State& state) {
  push(state, run_in_turn);
}
BENCHMARK(one_core)
    ->ArgNames({"points", "range", "smooth"})
    ->ArgsProduct({{100000}, {10, 25, 50, 75, 100}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

void two_cores(benchmark::State& state) {
  push(state, two_threads);
}
BENCHMARK(two_cores)
    ->ArgNames({"points", "range", "smooth"})
    ->ArgsProduct({{100000}, {10, 25, 50, 75, 100}, {0, 1}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void baseline_all_pairs(benchmark::State& state) {
  const Scene scene = make_scene(static_cast<std::size_t>(state.range(0)), 1000);
  const std::vector<Contact> contacts = scene.solver.contacts();
  const double square = 0.25 * scene.solver.squared_reach_m2(contacts);
  for (auto _ : state) {
    benchmark::DoNotOptimize(propagate_all_pairs(scene.rest, contacts, square, Falloff::literal));
  }
  state.counters["updates/s"] = benchmark::Counter(1, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(baseline_all_pairs)->ArgName("points")->Arg(100000)->Unit(benchmark::kMillisecond);

void farthest_distance(benchmark::State& state) {
  const Scene scene = make_scene(static_cast<std::size_t>(state.range(0)), 1000);
  const std::vector<Contact> contacts = scene.solver.contacts();
  for (auto _ : state) benchmark::DoNotOptimize(scene.solver.squared_reach_m2(contacts));
}
BENCHMARK(farthest_distance)->ArgName("points")->Arg(100000)->Unit(benchmark::kMillisecond);

void begin_gesture(benchmark::State& state) {
  const Scene scene = make_scene(static_cast<std::size_t>(state.range(0)), 1000);
  for (auto _ : state) benchmark::DoNotOptimize(PushSolver::create(scene.rest));
}
BENCHMARK(begin_gesture)->ArgName("points")->Arg(1000)->Arg(100000)->Unit(benchmark::kMillisecond);

void move_disk(benchmark::State& state) {
  const Scene scene = make_scene(static_cast<std::size_t>(state.range(0)), 1000);
  for (auto _ : state) {
    state.PauseTiming();
    PushSolver solver = scene.solver;
    state.ResumeTiming();
    benchmark::DoNotOptimize(solver.move_disk({{0.051, 0.02, 0.069}, {0.12, 0, -1}, 0.02}));
  }
}
BENCHMARK(move_disk)->ArgName("points")->Arg(100000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace handloft::geometry
