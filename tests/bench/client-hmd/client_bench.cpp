// What a delta costs the network's thread, and a frame the frame loop (in software, where there is no
// graphics card).

#include <benchmark/benchmark.h>

#include "client-hmd/mirror/scene_mirror.h"
#include "client-hmd/render/offscreen_context.h"
#include "client-hmd/render/renderer.h"
#include "client-hmd/view/orbit_camera.h"
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

/// A frame of range(0) x range(1) pixels of the synthetic scene.
void draw_frame(benchmark::State& state) {
  const auto context = OffscreenContext::create();
  if (!context) return state.SkipWithError("no OpenGL");
  const auto renderer = Renderer::create();
  if (!renderer) return state.SkipWithError("no renderer");
  Frame frame;
  frame.scene = test::synthetic_scene();
  frame.eye = OrbitCamera().eye(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  for (auto _ : state) benchmark::DoNotOptimize((*renderer)->draw_offscreen(frame, {}).ok());
}
BENCHMARK(draw_frame)
    ->Args({640, 360})
    ->Args({1280, 720})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace handloft::client
