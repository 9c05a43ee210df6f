// Cost of one simulated 640x480 frame per camera, moving hand, noise and JPEG included: three cameras at 30
// frames a second must fit in well under half a core (4 ms a frame would be 36 % of one).

#include <benchmark/benchmark.h>

#include <cmath>

#include "daemon-tracking/source/simulated/camera_renderer.h"
#include "daemon-tracking/source/simulated/mouse_shell.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"

namespace {

using namespace handloft::tracking;

constexpr double frame_s = 1.0 / 30, third_s = 0.002;

Exposure exposure_at(const HandProgram& program, double time) {
  return {program.at(time - third_s), program.at(time), program.at(time + third_s), HeadMotion{}.at(time)};
}

void render_frame(benchmark::State& state) {
  const Rig rig = default_rig();
  const HandProgram program = mouse_shell_program();
  CameraRenderer renderer(rig, static_cast<std::size_t>(state.range(0)), ImageOptions{});
  state.SetLabel(rig.cameras[static_cast<std::size_t>(state.range(0))].name);
  std::uint64_t frame = 0;
  for (auto _ : state) {
    const double time = std::fmod(static_cast<double>(frame++) * frame_s, program.duration_s());
    benchmark::DoNotOptimize(renderer.render(exposure_at(program, time), frame));
  }
}
BENCHMARK(render_frame)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

/// Without JPEG.
void draw_frame(benchmark::State& state) {
  const Rig rig = default_rig();
  const HandProgram program = mouse_shell_program();
  CameraRenderer renderer(rig, static_cast<std::size_t>(state.range(0)), ImageOptions{});
  std::uint64_t frame = 0;
  for (auto _ : state) {
    const double time = std::fmod(static_cast<double>(frame++) * frame_s, program.duration_s());
    benchmark::DoNotOptimize(renderer.draw(exposure_at(program, time), frame).y.data());
  }
}
BENCHMARK(draw_frame)->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

void evaluate_program(benchmark::State& state) {
  const HandProgram program = mouse_shell_program();
  double time = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(program.at(time));
    time = std::fmod(time + 0.01, program.duration_s());
  }
}
BENCHMARK(evaluate_program);

void open_table_camera(benchmark::State& state) {
  const Rig rig = default_rig();
  for (auto _ : state) CameraRenderer(rig, 0, ImageOptions{});
}
BENCHMARK(open_table_camera)->Unit(benchmark::kMillisecond);

}  // namespace
