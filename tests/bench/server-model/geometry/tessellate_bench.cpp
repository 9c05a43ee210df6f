// Meshing a surface while a hand shapes it: must fit in a frame of 11 ms many times over (X4).

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>

#include "server-model/geometry/tessellate.h"

namespace handloft::geometry {
namespace {

void tessellate_dome(benchmark::State& state) {
  const auto dome = PolynomialSurface::from_coefficients(2, std::array{0.02, 0., 0., 0.5, -2., -4.});
  const auto superellipse = Superellipse::create({{0, 0}, {0.06, 0.04}}, 2.5);
  TessellationOptions options;
  options.chord_tolerance_m = std::pow(10.0, -static_cast<double>(state.range(0)));
  std::size_t vertices = 0;
  for (auto _ : state) {
    const auto mesh = tessellate(*dome, Frame{}, *superellipse, options);
    vertices = mesh->vertex_count();
    benchmark::DoNotOptimize(mesh);
  }
  state.counters["vertices"] = static_cast<double>(vertices);
  state.counters["vertices/s"] =
      benchmark::Counter(static_cast<double>(vertices), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(tessellate_dome)->ArgName("tolerance_1e-")->Arg(3)->Arg(4)->Arg(5)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace handloft::geometry
