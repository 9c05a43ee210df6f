// What a daemon costs and how old its frames are: `bench_trackd_load [SECONDS]` runs four cameras at 30 fps
// and two at 60, 640 x 480 with head and hand, on two processors, each with one subscriber over the socket,
// and prints CPU, dropped frames and the histogram of the daemon's own latency (T15). Pictures are drawn
// beforehand.

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <string>

#include "common/net/io_thread.h"
#include "common/net/message_client.h"
#include "daemon-tracking/main/fusion_stage.h"
#include "daemon-tracking/main/live_session.h"
#include "daemon-tracking/main/repeated_stream.h"
#include "daemon-tracking/source/paced_source.h"
#include "proto/session.pb.h"
#include "tests/bench/daemon-tracking/main/prerendered_rig.h"

namespace handloft::tracking {
namespace {

constexpr double prerendered_s = 6.0;
constexpr int processors = 2;
constexpr auto patience = std::chrono::seconds(10);

double cpu_seconds() {
  constexpr double us_per_s = 1e6;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) / us_per_s;
}

struct Load {
  int cameras = 4;
  double rate_hz = 30.0;
};

void print_histogram(const char* name, const Percentiles& values) {
  fmt::print("  {:<22} p50 {:.2f} ms, p95 {:.2f} ms, p99 {:.2f} ms, worst {:.2f} ms ({} frames)\n", name,
             values.at(0.5), values.at(0.95), values.at(0.99), values.at(1.0), values.count());
}

void print_buckets(const LatencyHistogram& histogram) {
  std::uint64_t below = 0;
  fmt::print("  own latency, ms       ");
  for (std::size_t i = 0; i < LatencyHistogram::bounds_ms.size(); ++i) {
    fmt::print(" <={:g}: {:.1f}%", LatencyHistogram::bounds_ms[i],
               100.0 * static_cast<double>(histogram.up_to[i] - below) /
                   static_cast<double>(std::max<std::uint64_t>(histogram.count(), 1)));
    below = histogram.up_to[i];
  }
  fmt::print("\n");
}

int measure(const Load& load, double seconds) {
  fmt::print("{} cameras of 640x480 at {:g} fps, head and hand, {} processors, {:g} s\n", load.cameras,
             load.rate_hz, processors, seconds);
  const PrerenderedSession session = prerender(load.cameras, load.rate_hz, prerendered_s);
  const SystemClock clock;
  const Logger log("load", LogLevel::warning);
  net::IoThread io;
  auto publisher = Publisher::listen(
      io.context().get_executor(),
      *net::parse_endpoint(fmt::format("unix:/tmp/handloft-load-{}.sock", getpid())), clock, log);
  if (!publisher) return std::fprintf(stderr, "%s\n", publisher.error().describe().c_str()), 1;
  auto pipeline = TrackingPipeline::create(session.rig);
  if (!pipeline) return std::fprintf(stderr, "%s\n", pipeline.error().describe().c_str()), 1;
  CameraTrackerOptions tracker_options;
  tracker_options.stopwatch = &clock;
  std::vector<CameraTracker> trackers;
  for (std::uint32_t i = 0; i < session.rig.cameras.size(); ++i)
    trackers.push_back(std::move(*CameraTracker::create(session.rig, i, tracker_options)));
  SessionControl control;
  PaceOptions pace;
  pace.start = TimeLineStart::when_prepared;
  pace.on_end = [&] { control.note_end(); };
  const auto rounds = static_cast<std::uint64_t>(seconds / prerendered_s) + 1;
  PacedSource source("rig", std::make_unique<RepeatedStream>([&] { return stream_of(session); }, rounds),
                     clock, pace);
  LiveSession live({&source}, std::move(trackers), clock, log, nullptr);
  MetricsBoard board;
  StageParts parts;
  parts.metrics = &board;
  parts.losses = [&] { return live.losses(); };
  FusionStage stage(std::move(*pipeline), **publisher, clock, TimeLine::present, log, std::move(parts));

  net::ClientOptions client_options;
  client_options.role = v1::ROLE_SUBSCRIBER;
  auto client = net::SyncClient::connect((*publisher)->endpoint(), client_options, clock);
  if (!client) return std::fprintf(stderr, "%s\n", client.error().describe().c_str()), 1;
  v1::Envelope subscribe;
  subscribe.mutable_subscribe();
  (void)client->send(subscribe);
  std::atomic<std::uint64_t> received{0};
  auto reader = std::async(std::launch::async, [&] {
    while (client->receive(patience).ok()) ++received;
  });

  const double cpu_before = cpu_seconds();
  const TimePoint began = clock.now();
  live.run(stage, control, [] { return false; });
  const double wall_s = to_seconds(clock.now() - began);
  const double cpu_s = cpu_seconds() - cpu_before;
  const SessionFigures figures = stage.figures(live.losses());
  stage.publish_end();
  const MetricsSnapshot snapshot = board.get();
  (*publisher)->stop();
  reader.wait();
  io.finish();

  std::uint64_t frames = 0, dropped = 0, missing = 0;
  Percentiles vision;
  for (const CameraFigures& camera : figures.cameras) {
    frames += camera.frames;
    dropped += camera.dropped;
    missing += camera.missing;
    fmt::print("  camera {:<6} {} frames, {} dropped, vision p50 {:.2f} ms, p99 {:.2f} ms\n", camera.name,
               camera.frames, camera.dropped, camera.vision_ms.at(0.5), camera.vision_ms.at(0.99));
  }
  fmt::print(
      "  CPU {:.1f} % of one processor ({:.2f} ms a frame); {} frames, {} dropped, {} never delivered\n",
      100.0 * cpu_s / wall_s, 1000.0 * cpu_s / static_cast<double>(std::max<std::uint64_t>(frames, 1)),
      frames, dropped, missing);
  fmt::print("  subscriber received {} frames, missed {}\n", received.load(), figures.missed_by_subscribers);
  print_histogram("exposure to socket", figures.capture_to_publish_ms);
  print_histogram("arrival to socket", figures.arrival_to_publish_ms);
  print_buckets(snapshot.arrival_to_publish);
  return 0;
}

}  // namespace
}  // namespace handloft::tracking

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 30.0;
  cpu_set_t some;
  CPU_ZERO(&some);
  for (int i = 0; i < handloft::tracking::processors; ++i) CPU_SET(i, &some);
  sched_setaffinity(0, sizeof(some), &some);
  int failed = 0;
  for (const handloft::tracking::Load load :
       {handloft::tracking::Load{4, 30.0}, handloft::tracking::Load{2, 60.0}})
    failed |= handloft::tracking::measure(load, seconds);
  return failed;
}
