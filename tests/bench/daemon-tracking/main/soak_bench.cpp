// Endurance: `bench_trackd_soak [SIMULATED_MINUTES [RECORDING_SECONDS]]` has the real daemon replay a
// recording of the simulated rig over and over, with every device unplugged between two rounds, as fast as it
// goes and with one subscriber to every frame, and prints for each simulated minute how much memory it holds,
// what a frame costs and how long a frame is on its way to the subscriber. Neither may grow: the last line
// compares the last tenth with the first after a warm-up.

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "common/net/message_client.h"
#include "proto/session.pb.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft {
namespace {

constexpr double ns_per_s = 1e9;
constexpr std::int64_t minute_ns = 60'000'000'000;
constexpr auto patience = std::chrono::seconds(60);

struct Minute {
  double resident_mib = 0.0;
  double cpu_ms_per_frame = 0.0;
  double p50_us = 0.0, p99_us = 0.0;  // Published to received.
  std::uint64_t frames = 0;
};

double resident_mib(pid_t pid) {
  std::ifstream in(fmt::format("/proc/{}/statm", pid));
  double all = 0.0, resident = 0.0;
  in >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

// User and system time of a process, its threads included.
double cpu_seconds(pid_t pid) {
  std::ifstream in(fmt::format("/proc/{}/stat", pid));
  std::string text((std::istreambuf_iterator<char>(in)), {});
  text.erase(0, std::min(text.size(), text.rfind(')') + 2));
  std::vector<std::string> fields;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    fields.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  constexpr std::size_t user = 11, system = 12;  // Counted from the state, the third of proc(5).
  if (fields.size() <= system) return 0.0;
  return (std::atof(fields[user].c_str()) + std::atof(fields[system].c_str())) /
         static_cast<double>(sysconf(_SC_CLK_TCK));
}

double percentile(std::vector<double>& values, double fraction) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

int soak(double minutes, double recording_s) {
  const test::TemporaryDirectory folder;
  const std::string program = test::program("handloft-trackd").string();
  const std::string recording = (folder.path() / "a.rec").string();
  const std::string endpoint = "unix:" + (folder.path() / "t.sock").string();
  const SystemClock clock;
  net::ClientOptions client_options;
  client_options.role = v1::ROLE_SUBSCRIBER;
  client_options.connect_timeout = std::chrono::seconds(20);
  v1::Envelope subscribe;
  subscribe.mutable_subscribe()->set_delivery(v1::Subscribe::EVERY);

  fmt::print("recording {:g} s of the simulated rig\n", recording_s);
  {
    test::Process daemon({program, "--simulate", "tour", "--pace", "fast", "--no-video", "--log-level", "off",
                          "--listen", endpoint, "--wait-for-subscribers", "1", "--record", recording},
                         folder.path() / "errors.txt");
    auto client = net::SyncClient::connect(*net::parse_endpoint(endpoint), client_options, clock);
    if (!client || !client->send(subscribe)) return 1;
    std::int64_t first = 0;
    for (;;) {
      const auto message = client->receive(patience);
      if (!message) return 1;
      const std::int64_t time = message->tracking().capture_time_ns();
      if (first == 0) first = time;
      if (message->tracking().end_of_recording() ||
          static_cast<double>(time - first) > recording_s * ns_per_s)
        break;
    }
    { const net::SyncClient gone = std::move(*client); }  // or the daemon would wait for it to read on
    daemon.signal(SIGTERM);
    if (daemon.wait(patience) != std::optional<int>(0)) return 1;
  }

  const auto rounds = static_cast<std::uint64_t>(minutes * 60.0 / recording_s) + 2;
  test::Process daemon({program, "replay", recording, "--repeat", std::to_string(rounds), "--listen",
                        endpoint, "--log-level", "warning", "--wait-for-subscribers", "1"},
                       folder.path() / "errors.txt");
  auto client = net::SyncClient::connect(*net::parse_endpoint(endpoint), client_options, clock);
  if (!client || !client->send(subscribe)) return 1;
  fmt::print("{:>6} {:>9} {:>9} {:>13} {:>11} {:>11}\n", "minute", "frames", "RSS MiB", "CPU ms/frame",
             "p50 us", "p99 us");
  std::vector<Minute> told;
  std::vector<double> on_the_way_us;
  std::int64_t first = 0;
  double cpu_then = cpu_seconds(daemon.pid());
  while (static_cast<double>(told.size()) < minutes) {
    const auto message = client->receive(patience);
    if (!message) {
      std::fprintf(stderr, "%s\n%s", message.error().describe().c_str(), daemon.error_output().c_str());
      return 1;
    }
    const v1::TrackingFrame& frame = message->tracking();
    constexpr double ns_per_us = 1000.0;
    on_the_way_us.push_back(static_cast<double>(to_ns(clock.now()) - frame.publish_time_ns()) / ns_per_us);
    if (first == 0) first = frame.capture_time_ns();
    if (frame.capture_time_ns() - first < static_cast<std::int64_t>(told.size() + 1) * minute_ns) continue;
    const double cpu = cpu_seconds(daemon.pid());
    Minute minute;
    minute.frames = on_the_way_us.size();
    minute.resident_mib = resident_mib(daemon.pid());
    minute.cpu_ms_per_frame = 1000.0 * (cpu - cpu_then) / static_cast<double>(minute.frames);
    minute.p50_us = percentile(on_the_way_us, 0.5);
    minute.p99_us = percentile(on_the_way_us, 0.99);
    told.push_back(minute);
    cpu_then = cpu;
    on_the_way_us.clear();
    fmt::print("{:>6} {:>9} {:>9.2f} {:>13.3f} {:>11.0f} {:>11.0f}\n", told.size(), minute.frames,
               minute.resident_mib, minute.cpu_ms_per_frame, minute.p50_us, minute.p99_us);
    std::fflush(stdout);
  }
  // The first tenth fills pools and percentiles' memories.
  const std::size_t tenth = std::max<std::size_t>(told.size() / 10, 1);
  const auto mean = [&](std::size_t from, auto field) {
    double sum = 0.0;
    for (std::size_t i = from; i < from + tenth; ++i) sum += told[i].*field;
    return sum / static_cast<double>(tenth);
  };
  const std::size_t early = std::min(tenth, told.size() - tenth), late = told.size() - tenth;
  fmt::print("from minute {} to {}: RSS {:+.2f} MiB, CPU per frame {:+.1f} %, p99 on the way {:+.0f} us\n",
             early + 1, told.size(), mean(late, &Minute::resident_mib) - mean(early, &Minute::resident_mib),
             100.0 * (mean(late, &Minute::cpu_ms_per_frame) / mean(early, &Minute::cpu_ms_per_frame) - 1.0),
             mean(late, &Minute::p99_us) - mean(early, &Minute::p99_us));
  daemon.signal(SIGTERM);
  return 0;
}

}  // namespace
}  // namespace handloft

int main(int argc, char** argv) {
  const double minutes = argc > 1 ? std::atof(argv[1]) : 60.0;
  const double recording_s = argc > 2 ? std::atof(argv[2]) : 30.0;
  return handloft::soak(minutes, recording_s);
}
