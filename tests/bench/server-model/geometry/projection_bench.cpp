// Closest points of a B-spline surface of 100 x 100 control points, bicubic: places near it (within 2 % of
// its size), around it (half its size) and far away; rays; against OCCT in the same run. Arguments: threads.

#include <benchmark/benchmark.h>

#include <GeomAPI_ProjectPointOnSurf.hxx>
#include <atomic>
#include <thread>

#include "server-model/geometry/bspline_projection.h"
#include "server-model/geometry/bspline_tessellate.h"
#include "server-model/geometry/grid_tessellation.h"
#include "tests/unit/server-model/geometry/bspline_shapes.h"

namespace handloft::geometry {
namespace {

using samples::Random;
using samples::uniform;

/// Distances of places along the normal, as parts of the surface's size (1 m).
constexpr double near = 0.02, around = 0.5, far = 10;

std::vector<Vec3> places_at(const BSplineSurface& surface, double reach, std::size_t count) {
  Random random(1);
  std::vector<Vec3> places;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 on = surface.evaluate(uniform(random, 0, 1), uniform(random, 0, 1));
    places.push_back(on +
                     reach * Vec3(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)));
  }
  return places;
}

ParallelFor on_threads(std::int64_t threads) {
  return [threads](std::size_t count, const std::function<void(std::size_t)>& task) {
    std::atomic<std::size_t> next = 0;
    const auto work = [&] {
      for (std::size_t k = next++; k < count; k = next++) task(k);
    };
    std::vector<std::thread> others;
    for (std::int64_t k = 1; k < threads; ++k) others.emplace_back(work);
    work();
    for (std::thread& other : others) other.join();
  };
}

void closest(benchmark::State& state, const BSplineSurface& surface, double reach) {
  const SurfaceProjector projector = *SurfaceProjector::create(surface);
  const std::vector<Vec3> places = places_at(surface, reach, 20'000);
  std::vector<ClosestOnSurface> answers(places.size());
  const ParallelFor parallel = on_threads(state.range(0));
  for (auto _ : state) {
    if (!projector.closest(places, answers, parallel).ok()) state.SkipWithError("refused");
    benchmark::DoNotOptimize(answers.data());
  }
  double gap = 0;
  for (const ClosestOnSurface& answer : answers) gap = std::max(gap, answer.gap_m);
  state.counters["largest_gap_m"] = gap;
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(places.size()));
}
void closest_near(benchmark::State& state) {
  closest(state, samples::wavy(100, 100), near);
}
void closest_around(benchmark::State& state) {
  closest(state, samples::wavy(100, 100), around);
}
void closest_far(benchmark::State& state) {
  closest(state, samples::wavy(100, 100), far);
}
void closest_near_rational(benchmark::State& state) {
  BSplineSurface surface = samples::wavy(100, 100);
  Random random(2);
  surface.weights = samples::random_weights(random, surface.control.size(), samples::Weights::random);
  closest(state, surface, near);
}
BENCHMARK(closest_near)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(closest_around)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(closest_far)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(closest_near_rational)->Arg(1)->UseRealTime()->Unit(benchmark::kMillisecond);

/// From the last answer, as a hand that moves along asks.
void closest_tracking(benchmark::State& state) {
  const BSplineSurface surface = samples::wavy(100, 100);
  const SurfaceProjector projector = *SurfaceProjector::create(surface);
  std::vector<Vec3> path;
  for (int k = 0; k < 10'000; ++k) {
    const double t = k * 1e-4;
    path.push_back(surface.evaluate(0.1 + 0.8 * t, 0.5 + 0.3 * std::sin(9 * t)) + Vec3(0, 0, 0.01));
  }
  for (auto _ : state) {
    Vec2 seed(0.1, 0.5);
    for (const Vec3& place : path) seed = projector.closest(place, seed)->uv;
    benchmark::DoNotOptimize(seed);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(path.size()));
}
BENCHMARK(closest_tracking)->Unit(benchmark::kMillisecond);

void occt(benchmark::State& state, double reach) {
  const BSplineSurface surface = samples::wavy(100, 100);
  const Handle(Geom_BSplineSurface) theirs = samples::to_occt(surface);
  const SurfaceProjector ours = *SurfaceProjector::create(surface);
  const std::vector<Vec3> places = places_at(surface, reach, 10);
  GeomAPI_ProjectPointOnSurf projector;
  projector.Init(theirs, 0.0, 1.0, 0.0, 1.0);
  double apart = 0, nearer = 0;
  for (auto _ : state) {
    for (const Vec3& place : places) {
      projector.Perform(gp_Pnt(place.x(), place.y(), place.z()));
      if (projector.NbPoints() == 0) continue;
      const double difference = projector.LowerDistance() - ours.closest(place)->distance_m;
      apart = std::max(apart, difference);  // Where OCCT misses the nearest place, or it lies on an edge.
      nearer = std::max(nearer, -difference);
    }
  }
  state.counters["occt_nearer_m"] = nearer;
  state.counters["occt_farther_m"] = apart;
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(places.size()));
}
void occt_near(benchmark::State& state) {
  occt(state, near);
}
void occt_around(benchmark::State& state) {
  occt(state, around);
}
BENCHMARK(occt_near)->Unit(benchmark::kMillisecond);
BENCHMARK(occt_around)->Unit(benchmark::kMillisecond);

void rays(benchmark::State& state) {
  const BSplineSurface surface = samples::wavy(100, 100);
  const SurfaceProjector projector = *SurfaceProjector::create(surface);
  const std::vector<Vec3> targets = places_at(surface, 0, 5000);
  std::vector<Vec3> origins, directions;
  Random random(3);
  for (const Vec3& target : targets) {
    origins.emplace_back(uniform(random, -1, 2), uniform(random, -1, 2), uniform(random, 0.2, 1));
    directions.push_back(target - origins.back());
  }
  std::vector<std::optional<SurfaceHit>> hits(targets.size());
  for (auto _ : state) {
    if (!projector.rays(origins, directions, hits).ok()) state.SkipWithError("refused");
    benchmark::DoNotOptimize(hits.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(targets.size()));
}
BENCHMARK(rays)->Unit(benchmark::kMillisecond);

void make_projector(benchmark::State& state) {
  const BSplineSurface surface = samples::wavy(100, 100);
  for (auto _ : state) benchmark::DoNotOptimize(SurfaceProjector::create(surface));
}
BENCHMARK(make_projector)->Unit(benchmark::kMillisecond);

/// Argument: control points a side that move.
void refit(benchmark::State& state) {
  BSplineSurface surface = samples::wavy(100, 100);
  SurfaceProjector projector = *SurfaceProjector::create(surface);
  for (auto _ : state) {
    for (int i = 0; i < state.range(0); ++i) {
      for (int j = 0; j < state.range(0); ++j) surface.control[surface.index(i, j)].z() += 1e-6;
    }
    if (!projector.refit(surface.control).ok()) state.SkipWithError("refused");
  }
}
BENCHMARK(refit)->Arg(1)->Arg(20)->Arg(100)->Unit(benchmark::kMicrosecond);

/// 159 x 81 control points with 48,536 polygons or a few more, as the sculpting paper's largest (Table 2).
GridParameters table2_grid() {
  const auto even = [](int n) {
    std::vector<double> values;
    for (int k = 0; k < n; ++k) values.push_back(static_cast<double>(k) / (n - 1));
    return values;
  };
  return {even(220), even(112)};
}

/// A frame of a drag. Argument: control points a side that move; 0: all.
void update_grid(benchmark::State& state) {
  BSplineSurface surface = samples::wavy(159, 81);
  GridTessellation grid = *GridTessellation::create(surface, table2_grid());
  for (auto _ : state) {
    if (state.range(0) == 0) {
      for (Vec3& p : surface.control) p.z() += 1e-6;
    }
    for (int i = 0; i < state.range(0); ++i) {
      for (int j = 0; j < state.range(0); ++j) surface.control[surface.index(40 + i, 20 + j)].z() += 1e-6;
    }
    if (!grid.update(surface.control).ok()) state.SkipWithError("refused");
  }
  state.counters["polygons"] = static_cast<double>(grid.mesh().triangle_count());
  state.counters["changed_vertices"] = static_cast<double>(grid.changed().size());
}
BENCHMARK(update_grid)->Arg(0)->Arg(1)->Arg(10)->Arg(40)->Unit(benchmark::kMicrosecond);

/// The baseline: all places and normals of the grid from nothing.
void evaluate_whole_grid(benchmark::State& state) {
  const BSplineSurface surface = samples::wavy(159, 81);
  const GridParameters grid = table2_grid();
  std::vector<Vec3> places, normals;
  for (auto _ : state) {
    evaluate_grid(surface, grid.us, grid.vs, places, &normals);
    benchmark::DoNotOptimize(places.data());
  }
}
BENCHMARK(evaluate_whole_grid)->Unit(benchmark::kMicrosecond);

void tessellate_whole(benchmark::State& state) {
  const BSplineSurface surface = samples::wavy(100, 100);
  std::size_t triangles = 0;
  for (auto _ : state) triangles = tessellate(surface)->triangle_count();
  state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK(tessellate_whole)->Unit(benchmark::kMillisecond);

void tessellate_trimmed(benchmark::State& state) {
  const BSplineSurface surface = samples::wavy(100, 100);
  TrimLoop loop;
  for (int k = 0; k < 200; ++k) {
    const double turn = 2 * M_PI * k / 200, radius = 0.35 + 0.05 * std::cos(6 * turn);
    loop.emplace_back(0.5 + radius * std::cos(turn), 0.5 + radius * std::sin(turn));
  }
  std::size_t triangles = 0;
  for (auto _ : state) {
    triangles = tessellate(surface, {loop, {{0.4, 0.4}, {0.6, 0.4}, {0.5, 0.6}}})->triangle_count();
  }
  state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK(tessellate_trimmed)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace handloft::geometry
