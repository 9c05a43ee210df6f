// What a frame costs from the driver's buffer to the sink's hands (T15: at most 6 ms of ours for everything):
// the copy into pooled memory against fresh memory for each frame and against memcpy alone, and a whole turn
// of the stream over a driver that answers at once.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <numeric>
#include <thread>

#include "daemon-tracking/source/camera/frame_pool.h"
#include "daemon-tracking/source/camera/v4l2_camera.h"
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

// Several cameras at once, each paced by a driver of its own: how long a filled buffer waits until the sink
// has its bytes, and how many frames found no free buffer.
void cameras_at_rate(benchmark::State& state) {
  constexpr auto length = std::chrono::seconds(5);
  const auto cameras = static_cast<std::size_t>(state.range(0));
  const Duration interval = from_seconds(1.0 / static_cast<double>(state.range(1)));
  const SystemClock clock;
  std::mutex mutex;
  std::vector<double> waits_ms;
  std::uint64_t lost = 0, drained = 0;
  for (auto _ : state) {
    const auto system = std::make_shared<testing::FakeV4l2System>();
    std::vector<std::unique_ptr<V4l2Camera>> sources;
    std::vector<std::string> nodes;
    for (std::size_t i = 0; i < cameras; ++i) {
      testing::FakeCamera camera;
      camera.node.node = "/dev/video" + std::to_string(i);
      nodes.push_back(camera.node.node);
      system->plug(camera);
      V4l2CameraOptions options;
      options.selector.node = camera.node.node;
      options.mode.rate_hz = static_cast<double>(state.range(1));
      sources.push_back(make_v4l2_camera(static_cast<std::uint32_t>(i), camera.node.node, options, clock,
                                         Logger("bench", LogLevel::off), system));
      const Status started = sources.back()->start([&](Sample sample) {
        const auto* frame = std::get_if<CameraFrame>(&sample);
        if (frame == nullptr) return;
        const Duration wait = clock.now() - frame->capture_time;
        const std::lock_guard lock(mutex);
        waits_ms.push_back(to_seconds(wait) * 1000.0);
      });
      if (!started) return state.SkipWithError("not started");
      while (!system->streaming(nodes.back())) std::this_thread::yield();
    }
    const TimePoint end = clock.now() + length;
    testing::FakeFrame frame;
    frame.bytes = testing::fake_jpeg(mjpeg_bytes);
    frame.flags = testing::good_stamp_flags;
    for (TimePoint next = clock.now(); next < end; next += interval) {
      std::this_thread::sleep_for(next - clock.now());
      for (const std::string& node : nodes) {
        // Stamped at the moment when the buffer is full: its age at the sink is the wait.
        frame.timestamp_ns = to_ns(clock.now());
        lost += system->deliver(node, frame) ? 0 : 1;
      }
      ++frame.sequence;
    }
    for (const auto& source : sources) {
      drained += source->health().drained;
      source->stop();
    }
  }
  std::sort(waits_ms.begin(), waits_ms.end());
  const auto part = [&](double p) {
    return waits_ms.empty()
               ? 0.0
               : waits_ms[static_cast<std::size_t>(p * static_cast<double>(waits_ms.size() - 1))];
  };
  state.counters["frames"] = static_cast<double>(waits_ms.size());
  state.counters["lost"] = static_cast<double>(lost);
  state.counters["drained"] = static_cast<double>(drained);
  state.counters["p50_ms"] = part(0.5);
  state.counters["p95_ms"] = part(0.95);
  state.counters["p99_ms"] = part(0.99);
}

BENCHMARK(memcpy_alone)->Arg(mjpeg_bytes)->Arg(yuyv_bytes)->Arg(large_bytes);
BENCHMARK(copy_to_fresh_memory)->Arg(mjpeg_bytes)->Arg(yuyv_bytes)->Arg(large_bytes);
BENCHMARK(copy_to_pooled_memory)->Arg(mjpeg_bytes)->Arg(yuyv_bytes)->Arg(large_bytes);
BENCHMARK(stream_turn)->Arg(mjpeg_bytes);
BENCHMARK(cameras_at_rate)
    ->Args({2, 60})
    ->Args({4, 30})
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace
}  // namespace handloft::tracking
