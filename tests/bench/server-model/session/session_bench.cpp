// From a tracking frame in to the delta out at a viewer's socket: a hop of the capture-to-client time,
// through the model's thread, the scene, the packing and a unix socket.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/table_palette.h"
#include "common/net/message_client.h"
#include "server-model/session/server.h"
#include "tests/support/hand_script.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;

/// What the hand does in the frames that are measured.
enum class Doing { stroke, push, profile, boundary };

void must(const Result<model::Submitted>& submitted) {
  if (!submitted) throw std::runtime_error(submitted.error().describe());
}

/// A slightly curved shape of `count` points over 0.2 m x 0.2 m at z = 0.1, fitted; shown as points, or with
/// its surface, whose mesh is then made anew for every frame.
model::Model plate(std::int64_t count, v1::Representation show) {
  model::Model model;
  v1::Operation operation;
  v1::AddPoints& add = *operation.mutable_add_points();
  add.set_entity("plate");
  add.mutable_create();
  const auto side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(count))));
  for (int i = 0; i < side; ++i) {
    for (int k = 0; k < side; ++k) {
      const double x = 0.2 * i / side - 0.1;
      const double y = 0.2 * k / side - 0.1;
      v1::Point& point = *add.add_points();
      point.mutable_position()->set_x(x);
      point.mutable_position()->set_y(y);
      point.mutable_position()->set_z(0.1 + x * x - y * y + 1e-4 * ((7 * i + 3 * k) % 5));
      point.set_pressure(0.6);
    }
  }
  must(model.submit(operation));
  v1::Operation fit;
  fit.mutable_fit()->set_entity("plate");
  fit.mutable_fit()->set_show(show);
  must(model.submit(fit));
  return model;
}

/// Frames before those that are measured: until the disk is in the plate, or the curve closed.
constexpr int lead_frames = 40;
/// After which a gesture ends, before it grows beyond what a hand does at once: three seconds.
constexpr int frames_a_gesture = 90;

/// The i-th frame of the gesture over the plate. From lead_frames on each changes the shape.
v1::TrackingFrame next_frame(test::HandScript& script, Doing doing, int i) {
  constexpr int period = 40;  // frames a way
  const double s = static_cast<double>(i % period) / period;
  const double turn = 2 * std::numbers::pi * std::min(i, lead_frames) / lead_frames;
  switch (doing) {
    case Doing::push:
      return script.closed({0.0, 0.0, 0.13 - 0.001 * i}, 0.4, 0.3 + 0.004 * (i % 50));
    case Doing::profile:
      return script.pointing({0.16 * s - 0.08, 0.0, 0.11});
    case Doing::boundary: {
      const double radius = 0.08 + 0.0005 * (i % 5);
      return script.pointing({radius * std::cos(turn), radius * std::sin(turn), 0.11});
    }
    case Doing::stroke:
      break;
  }
  return script.laying({0.16 * s - 0.08, 0.001, 0.1});
}

/// state.range(0): points that the shape has already.
void frame_to_delta(benchmark::State& state, Doing doing, v1::Representation show) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("handloft-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  SystemClock clock;
  Logger log("bench", LogLevel::error);
  boost::asio::io_context context;
  auto work = boost::asio::make_work_guard(context);
  net::Endpoint endpoint;
  endpoint.path = (folder / "model.sock").string();
  model::Model initial = state.range(0) > 0 ? plate(state.range(0), show) : model::Model();
  auto server = Server::start(context.get_executor(), {endpoint}, std::move(initial), {}, clock, log);
  if (!server) throw std::runtime_error(server.error().describe());
  std::thread io([&] { context.run(); });
  test::HandScript script;
  if (state.range(0) > 0) {  // strokes, too, go to the plate
    const PaletteCell& cell = palette_cell_of(PaletteCommand::select_next);
    (*server)->actor().push_frame(script.touching(cell.centre_x_m, cell.centre_y_m));
  }
  if (doing == Doing::boundary) {
    (*server)->actor().push_frame(script.resting());
    const PaletteCell& cell = palette_cell_of(PaletteCommand::trim_mode);
    (*server)->actor().push_frame(script.touching(cell.centre_x_m, cell.centre_y_m));
  }
  net::ClientOptions options;
  options.role = v1::ROLE_VIEWER;
  auto client = net::SyncClient::connect(endpoint, options, clock);
  if (!client) throw std::runtime_error(client.error().describe());
  v1::Envelope join;
  join.mutable_join();
  if (!client->send(join)) throw std::runtime_error("cannot join");
  const auto wait_for = [&](std::int64_t capture_time_ns) {
    while (true) {
      const auto envelope = client->receive(10s);
      if (!envelope) throw std::runtime_error(envelope.error().describe());
      if (envelope->has_delta() && envelope->delta().capture_time_ns() == capture_time_ns) return;
    }
  };
  std::vector<double> times_us;
  int frame_number = 0;
  for (auto _ : state) {
    if (doing != Doing::stroke && frame_number % frames_a_gesture == 0) {
      (*server)->actor().push_frame(script.resting({0.0, 0.0, 0.5}));
      if (frame_number > 0) {  // the plate as it was, or there would soon be nothing to push
        const PaletteCell& undo = palette_cell_of(PaletteCommand::undo);
        (*server)->actor().push_frame(script.touching(undo.centre_x_m, undo.centre_y_m));
        (*server)->actor().push_frame(script.resting({0.0, 0.0, 0.5}));
      }
      for (frame_number = 0; frame_number < lead_frames; ++frame_number) {
        (*server)->actor().push_frame(next_frame(script, doing, frame_number));
      }
      while (!(*server)->actor().idle()) std::this_thread::yield();
    }
    v1::TrackingFrame frame = next_frame(script, doing, frame_number++);
    const std::int64_t captured = frame.capture_time_ns();
    const auto start = std::chrono::steady_clock::now();
    (*server)->actor().push_frame(std::move(frame));
    wait_for(captured);
    const auto took = std::chrono::steady_clock::now() - start;
    times_us.push_back(std::chrono::duration<double, std::micro>(took).count());
    state.SetIterationTime(std::chrono::duration<double>(took).count());
  }
  std::sort(times_us.begin(), times_us.end());
  state.counters["median_us"] = times_us[times_us.size() / 2];
  state.counters["p99_us"] = times_us[times_us.size() * 99 / 100];
  server->reset();
  work.reset();
  io.join();
  std::filesystem::remove_all(folder);
}
void settings(benchmark::internal::Benchmark* bench) {
  bench->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(2000);
}
// 1,000 points: the whole chain in 2 ms (median). Points alone: the model's part. With the surface: its mesh
// follows a frame or two later, for which no hand waits.
BENCHMARK_CAPTURE(frame_to_delta, stroke, Doing::stroke, v1::REPRESENTATION_POINTS)
    ->Arg(0)
    ->Arg(1'000)
    ->Arg(10'000)
    ->Apply(settings);
BENCHMARK_CAPTURE(frame_to_delta, stroke_with_live_fit, Doing::stroke, v1::REPRESENTATION_BOTH)
    ->Arg(1'000)
    ->Apply(settings);
BENCHMARK_CAPTURE(frame_to_delta, push, Doing::push, v1::REPRESENTATION_POINTS)->Arg(1'000)->Apply(settings);
BENCHMARK_CAPTURE(frame_to_delta, push_with_live_fit, Doing::push, v1::REPRESENTATION_BOTH)
    ->Arg(1'000)
    ->Apply(settings);
BENCHMARK_CAPTURE(frame_to_delta, profile, Doing::profile, v1::REPRESENTATION_BOTH)
    ->Arg(1'000)
    ->Apply(settings);
BENCHMARK_CAPTURE(frame_to_delta, boundary, Doing::boundary, v1::REPRESENTATION_BOTH)
    ->Arg(1'000)
    ->Apply(settings);

}  // namespace
}  // namespace handloft::session
