#include "daemon-tracking/main/status_command.h"

#include <fmt/format.h>

#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/net/message_client.h"
#include "daemon-tracking/main/devices_command.h"
#include "daemon-tracking/main/exit_status.h"
#include "proto/session.pb.h"

namespace handloft::tracking {

namespace {

// Standing parts come about once a second, and to who subscribes at once.
constexpr auto patience = std::chrono::seconds(5);
constexpr auto answer_at_once = std::chrono::milliseconds(300);
constexpr double ns_per_s = 1e9;

bool has_alarm(const v1::TrackingFrame& frame) {
  for (const v1::DeviceHealth& device : frame.devices())
    if (!device.problem().empty()) return true;
  return false;
}

}  // namespace

Result<v1::TrackingFrame> ask_status(const DaemonOptions& options, const Clock& clock) {
  const Result<net::Endpoint> endpoint =
      options.listen.empty() ? net::default_tracking_endpoint() : net::parse_endpoint(options.listen);
  if (!endpoint) return endpoint.error();
  net::ClientOptions client_options;
  client_options.role = v1::ROLE_SUBSCRIBER;
  client_options.connect_timeout = answer_at_once;  // Whoever asks wants to know now whether it runs.
  auto client = net::SyncClient::connect(*endpoint, client_options, clock);
  if (!client) return client.error();
  v1::Envelope subscribe;
  subscribe.mutable_subscribe();
  if (const Status sent = client->send(subscribe); !sent) return sent.error();
  const TimePoint until = clock.now() + patience;
  while (clock.now() < until) {
    Result<v1::Envelope> message =
        client->receive(std::chrono::duration_cast<std::chrono::milliseconds>(until - clock.now()));
    if (!message) return message.error();
    if (message->tracking().fingertip_colours_size() > 0 || message->tracking().devices_size() > 0)
      return std::move(*message->mutable_tracking());
  }
  return make_error(ErrorCode::timeout, "the daemon publishes, but told of no devices", "status");
}

std::string status_text(const v1::TrackingFrame& frame, double age_s) {
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "{:<22} {:<8} {:>9} {:>9} {:>10} {:>8} {:>8}  {}\n", "device", "state", "rate/s",
                 "asked/s", "samples", "dropped", "refused", "identity");
  for (const v1::DeviceHealth& device : frame.devices()) {
    fmt::format_to(to, "{:<22} {:<8} {:>9.1f} {:>9} {:>10} {:>8} {:>8}  {}\n", printable(device.device()),
                   device.present() ? "there" : "absent", device.rate_hz(),
                   device.asked_rate_hz() > 0.0 ? fmt::format("{:.0f}", device.asked_rate_hz()) : "-",
                   device.samples(), device.dropped(), device.refused(), printable(device.identity()));
  }
  if (frame.latency().frames() > 0) {
    const v1::LatencyFigures& latency = frame.latency();
    fmt::format_to(to,
                   "exposure to socket over the last 10 s: p50 {:.1f} ms, p95 {:.1f} ms, p99 {:.1f} ms ({} "
                   "frames)\n",
                   latency.p50_ms(), latency.p95_ms(), latency.p99_ms(), latency.frames());
  }
  fmt::format_to(to, "frame {}, published {:.2f} s ago{}\n", frame.sequence(), age_s,
                 frame.end_of_recording() ? "; the session has ended" : "");
  for (const v1::DeviceHealth& device : frame.devices())
    if (!device.problem().empty())
      fmt::format_to(to, "ALARM {}: {}\n", printable(device.device()), printable(device.problem()));
  return fmt::to_string(out);
}

std::string status_json(const v1::TrackingFrame& frame, double age_s) {
  using nlohmann::json;
  json devices = json::array();
  for (const v1::DeviceHealth& device : frame.devices()) {
    devices.push_back({{"device", device.device()},
                       {"present", device.present()},
                       {"identity", device.identity()},
                       {"rate_hz", device.rate_hz()},
                       {"asked_rate_hz", device.asked_rate_hz()},
                       {"samples", device.samples()},
                       {"dropped", device.dropped()},
                       {"refused", device.refused()},
                       {"problem", device.problem()}});
  }
  const json document = {{"sequence", frame.sequence()},
                         {"age_s", age_s},
                         {"ended", frame.end_of_recording()},
                         {"devices", devices},
                         {"latency_ms",
                          {{"frames", frame.latency().frames()},
                           {"p50", frame.latency().p50_ms()},
                           {"p95", frame.latency().p95_ms()},
                           {"p99", frame.latency().p99_ms()}}}};
  return document.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

int run_status(const DaemonOptions& options, const Clock& clock) {
  const Result<v1::TrackingFrame> frame = ask_status(options, clock);
  if (!frame) {
    std::fprintf(stderr, "handloft-trackd: %s; is it running? `systemctl --user status handloft-trackd`\n",
                 frame.error().describe().c_str());
    return exit_failed;
  }
  const double age_s = static_cast<double>(to_ns(clock.now()) - frame->publish_time_ns()) / ns_per_s;
  std::fputs((options.json ? status_json(*frame, age_s) : status_text(*frame, age_s)).c_str(), stdout);
  return has_alarm(*frame) ? exit_failed : exit_ok;
}

}  // namespace handloft::tracking
