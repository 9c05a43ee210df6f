// From a tracking frame in to the delta out at a viewer's socket: a hop of the capture-to-client time,
// through the model's thread, the scene, the packing and a unix socket.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <thread>
#include <vector>

#include "common/net/message_client.h"
#include "server-model/session/server.h"
#include "tests/support/hand_script.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;

/// state.range(0): points that the shape has already.
void frame_to_delta(benchmark::State& state) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("handloft-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  SystemClock clock;
  Logger log("bench", LogLevel::error);
  boost::asio::io_context context;
  auto work = boost::asio::make_work_guard(context);
  net::Endpoint endpoint;
  endpoint.path = (folder / "model.sock").string();
  auto server = Server::start(context.get_executor(), {endpoint}, model::Model(), {}, clock, log);
  if (!server) throw std::runtime_error(server.error().describe());
  std::thread io([&] { context.run(); });
  test::HandScript script;
  for (int i = 0; i < state.range(0); ++i) {
    (*server)->actor().push_frame(script.laying({0.0001 * i, 0.0, 0.1}));
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
  for (auto _ : state) {
    v1::TrackingFrame frame = script.laying({0.0, 0.001, 0.1});
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
BENCHMARK(frame_to_delta)
    ->Arg(0)
    ->Arg(10'000)
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond)
    ->Iterations(2000);

}  // namespace
}  // namespace handloft::session
