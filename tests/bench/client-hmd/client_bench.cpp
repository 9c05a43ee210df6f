// What a delta costs the network's thread, and a frame the frame loop (in software, where there is no
// graphics card). Compare with the empty frame of the same size and run: machines differ, ratios do not.

#include <benchmark/benchmark.h>

#include "client-hmd/mirror/scene_mirror.h"
#include "client-hmd/render/offscreen_context.h"
#include "client-hmd/render/renderer.h"
#include "client-hmd/view/orbit_camera.h"
#include "tests/bench/client-hmd/grid_scene.h"
#include "tests/integration/client-hmd/synthetic_scene.h"
#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client {
namespace {

/// A growing stroke: one new point on top of range(0) held ones.
void apply_tail(benchmark::State& state) {
  SceneMirror held;
  if (!held.apply(test::snapshot(static_cast<std::uint32_t>(state.range(0)))).ok())
    state.SkipWithError("snapshot");
  v1::SceneDelta message = test::delta();
  *message.mutable_changed(0)->mutable_points() = test::cloud(static_cast<std::uint32_t>(state.range(0)), 1);
  for (auto _ : state) {
    SceneMirror mirror = held;
    benchmark::DoNotOptimize(mirror.apply(message).ok());
  }
}
BENCHMARK(apply_tail)->Arg(1'000)->Arg(100'000)->Unit(benchmark::kMicrosecond);

/// "top" with the sheet of range(0) vertices, dragged to `phase`; without triangles, which the viewer has.
v1::Mesh dragged_sheet(std::int64_t vertices, double phase, const v1::Mesh* known) {
  const auto side = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(vertices)))) - 1;
  const codec::MeshData data = bench::sheet_data(2 * side * side, phase);
  v1::Mesh mesh = known == nullptr ? *codec::encode_mesh(data) : *codec::encode_mesh(data, *known);
  mesh.set_topology(1);
  if (known != nullptr) mesh.clear_indices();
  return mesh;
}

/// A surface of range(0) vertices under a hand: items are deltas.
void drag_surface(benchmark::State& state) {
  v1::SceneSnapshot snapshot = test::snapshot();
  v1::Mesh& surface = *snapshot.mutable_entities(0)->mutable_surface();
  surface = dragged_sheet(state.range(0), 0.0, nullptr);
  SceneMirror mirror;
  if (!mirror.apply(snapshot).ok()) state.SkipWithError("snapshot");
  std::vector<v1::SceneDelta> deltas;
  for (int i = 0; i < 8; ++i) {
    deltas.push_back(test::delta());
    *deltas.back().mutable_changed(0)->mutable_surface() = dragged_sheet(state.range(0), 0.1 * i, &surface);
  }
  std::size_t next = 0;
  for (auto _ : state) {
    if (!mirror.apply(deltas[next++ % deltas.size()]).ok()) state.SkipWithError("delta");
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(drag_surface)->Arg(10'000)->Arg(100'000)->Unit(benchmark::kMicrosecond);

/// The whole scene again as it was, from a server that was started anew.
void apply_same_snapshot(benchmark::State& state) {
  v1::SceneSnapshot snapshot = test::snapshot(100'000);
  *snapshot.mutable_entities(0)->mutable_surface() = dragged_sheet(state.range(0), 0.0, nullptr);
  SceneMirror mirror;
  for (auto _ : state) benchmark::DoNotOptimize(mirror.apply(snapshot).ok());
}
BENCHMARK(apply_same_snapshot)->Arg(10'000)->Unit(benchmark::kMillisecond);

constexpr int width_px = 640, height_px = 360;

struct Drawing {
  std::unique_ptr<OffscreenContext> context;
  std::unique_ptr<Renderer> renderer;  ///< Destroyed first.

  static Drawing open(benchmark::State& state) {
    Drawing drawing;
    auto context = OffscreenContext::create();
    if (!context) state.SkipWithError("no OpenGL");
    if (!context) return drawing;
    drawing.context = std::move(*context);
    auto renderer = Renderer::create();
    if (!renderer) state.SkipWithError("no renderer");
    if (renderer) drawing.renderer = std::move(*renderer);
    return drawing;
  }
};

/// range(0) triangles and range(1) fuzzy points; none of either: what the others are compared with.
void draw_frame(benchmark::State& state) {
  const Drawing drawing = Drawing::open(state);
  if (drawing.renderer == nullptr) return;
  const auto triangles = static_cast<std::size_t>(state.range(0));
  const auto points = static_cast<std::size_t>(state.range(1));
  Frame frame;
  frame.scene = bench::scene_of(triangles == 0 ? nullptr : bench::sheet(triangles),
                                points == 0 ? nullptr : bench::scattered_points(points));
  frame.eye = OrbitCamera().eye(width_px, height_px);
  for (auto _ : state) benchmark::DoNotOptimize(drawing.renderer->draw_offscreen(frame, {}).ok());
}
BENCHMARK(draw_frame)
    ->ArgNames({"triangles", "points"})
    ->Args({0, 0})
    ->Args({100'000, 0})
    ->Args({0, 10'000})
    ->Args({100'000, 10'000})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

/// The same while a hand drags: another surface each frame.
void draw_dragged_frame(benchmark::State& state) {
  const Drawing drawing = Drawing::open(state);
  if (drawing.renderer == nullptr) return;
  const auto points = bench::scattered_points(static_cast<std::size_t>(state.range(1)));
  std::vector<std::shared_ptr<const Scene>> scenes;
  for (int i = 0; i < 4; ++i) {
    scenes.push_back(
        bench::scene_of(bench::sheet(static_cast<std::size_t>(state.range(0)), 0.2 * i), points));
  }
  Frame frame;
  frame.eye = OrbitCamera().eye(width_px, height_px);
  std::size_t next = 0;
  for (auto _ : state) {
    frame.scene = scenes[next++ % scenes.size()];
    benchmark::DoNotOptimize(drawing.renderer->draw_offscreen(frame, {}).ok());
  }
}
BENCHMARK(draw_dragged_frame)
    ->ArgNames({"triangles", "points"})
    ->Args({20'000, 10'000})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace handloft::client
