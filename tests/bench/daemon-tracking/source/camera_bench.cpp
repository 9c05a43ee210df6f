// What a frame costs from the driver's buffer to the sink's hands (T15: at most 6 ms of ours for everything):
// the copy into pooled memory against fresh memory for each frame and against memcpy alone, and a whole turn
// of the stream over a driver that answers at once.

#include <benchmark/benchmark.h>

#include <cstring>
#include <numeric>

#include "daemon-tracking/source/camera/frame_pool.h"
#include "daemon-tracking/source/camera/v4l2_stream.h"
#include "tests/support/fake_v4l2_system.h"

namespace handloft::tracking {
namespace {

// A webcam's MJPEG at 640 x 480, a raw picture of the same size, and 1280 x 720 raw.
constexpr std::int64_t mjpeg_bytes = 40'000, yuyv_bytes = 640 * 480 * 2, large_bytes = 1280 * 720 * 2;

std::vector<std::uint8_t> picture(std::int64_t bytes) {
  std::vector<std::uint8_t> from(static_cast<std::size_t>(bytes));
  std::iota(from.begin(), from.end(), static_cast<std::uint8_t>(0));
  return from;
}

void memcpy_alone(benchmark::State& state) {
  const std::vector<std::uint8_t> from = picture(state.range(0));
  std::vector<std::uint8_t> to(from.size());
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
}

void copy_to_fresh_memory(benchmark::State& state) {
  const std::vector<std::uint8_t> from = picture(state.range(0));
  for (auto _ : state) {
    const auto frame = std::make_shared<const std::vector<std::uint8_t>>(from);
    benchmark::DoNotOptimize(frame->data());
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
}

void copy_to_pooled_memory(benchmark::State& state) {
  const std::vector<std::uint8_t> from = picture(state.range(0));
  FramePool pool;
  for (auto _ : state) {
    const auto frame = pool.copy(from);
    benchmark::DoNotOptimize(frame->data());
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
}

void stream_turn(benchmark::State& state) {
  const auto system = std::make_shared<testing::FakeV4l2System>();
  testing::FakeCamera camera;
  camera.node.node = "/dev/video0";
  system->plug(camera);
  const SystemClock clock;
  FramePool pool;
  const auto stream = V4l2Stream::open(system, "/dev/video0", {}, clock, pool);
  if (!stream) {
    state.SkipWithError("no stream");
    return;
  }
  testing::FakeFrame frame;
  frame.bytes = testing::fake_jpeg(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) {
    state.PauseTiming();
    system->deliver("/dev/video0", frame);
    ++frame.sequence;
    state.ResumeTiming();
    benchmark::DoNotOptimize((*stream)->newest());
  }
}

BENCHMARK(memcpy_alone)->Arg(mjpeg_bytes)->Arg(yuyv_bytes)->Arg(large_bytes);
BENCHMARK(copy_to_fresh_memory)->Arg(mjpeg_bytes)->Arg(yuyv_bytes)->Arg(large_bytes);
BENCHMARK(copy_to_pooled_memory)->Arg(mjpeg_bytes)->Arg(yuyv_bytes)->Arg(large_bytes);
BENCHMARK(stream_turn)->Arg(mjpeg_bytes);

}  // namespace
}  // namespace handloft::tracking
