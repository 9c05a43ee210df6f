// The local hop: from publishing a TrackingFrame to its callback in a subscriber, against bare SOCK_SEQPACKET
// sockets between two threads, in the same run, in turns, at the same pace, with as many bytes: one way, and
// as a ping (there and back again). Prints medians, 99th percentiles and the ratios of medians.
//
//   bench_hop [messages per round] [rate in Hz] [unix|tcp]

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/net/message_client.h"
#include "common/net/message_server.h"
#include "daemon-tracking/publish/tracking_message.h"
#include "proto/session.pb.h"

namespace {

using namespace handloft;

constexpr int rounds = 6;

struct Statistics {
  double p50_us, p99_us;
};

Statistics statistics(std::vector<std::int64_t> ns) {
  std::sort(ns.begin(), ns.end());
  const auto at = [&](double share) {
    return static_cast<double>(ns[static_cast<std::size_t>(share * static_cast<double>(ns.size() - 1))]) /
           1e3;
  };
  return {at(0.5), at(0.99)};
}

// A frame as the daemon makes it most of the time: head, five fingertips, the camera that saw; no value is
// zero.
v1::Envelope full_frame() {
  tracking::FusedState state;
  state.time = from_ns(1'234'567'890'123);
  state.sequence = 12345;
  state.head.state = tracking::TrackingState::tracked;
  state.head.position_valid = state.head.orientation_valid = true;
  state.head.position_m = {0.01, -0.36, 0.46};
  state.head.orientation = Eigen::Quaterniond(0.8, 0.6, 0.01, 0.02).normalized();
  state.head.velocity_m_s = {0.01, 0.02, 0.03};
  state.head.angular_velocity_rad_s = {0.1, 0.2, 0.3};
  state.head.covariance = Eigen::Matrix<double, 6, 6>::Constant(1e-6);
  state.head.camera_mask = 7;
  state.head.tags = 8;
  state.head.reprojection_rms_px = 0.3;
  for (tracking::FusedTip& tip : state.hand.tips) {
    tip.state = tracking::TrackingState::tracked;
    tip.position_m = {0.01, 0.02, 0.1};
    tip.velocity_m_s = {0.1, 0.2, 0.3};
    tip.covariance_m2.setConstant(1e-7);
    tip.camera_mask = 3;
  }
  state.hand.glove_present = true;
  state.hand.gesture_since = state.time;
  state.hand.pressure = 0.4;
  state.hand.raw_force = 400;
  state.hand.pressing = true;
  state.hand.potentiometer = 0.5;
  state.hand.raw_potentiometer = 512;
  state.hand.battery_percent = 87;
  tracking::ShownFrame shown;
  shown.exposure_time = state.time;
  shown.world_from_camera = Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized());
  shown.world_from_camera.translation() = Eigen::Vector3d(-0.38, 0.54, 0.4);
  shown.state = tracking::TrackingState::tracked;
  v1::Envelope envelope;
  tracking::fill_tracking_frame(state, tracking::default_rig(), {shown}, *envelope.mutable_tracking());
  return envelope;
}

std::int64_t now_ns() {
  return to_ns(SystemClock().now());
}

template <typename Publish>
void paced(int count, double rate_hz, Publish publish) {
  auto next = std::chrono::steady_clock::now();
  for (int i = 0; i < count; ++i) {
    next += std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / rate_hz));
    std::this_thread::sleep_until(next);
    publish();
  }
}

class Collector {
 public:
  void add(std::int64_t ns) {
    const std::lock_guard lock(mutex_);
    ns_.push_back(ns);
    arrived_.notify_one();
  }
  std::vector<std::int64_t> wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    arrived_.wait_for(lock, std::chrono::seconds(10), [&] { return ns_.size() >= count; });
    return std::exchange(ns_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<std::int64_t> ns_;
};

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 1000;
  const double rate_hz = argc > 2 ? std::atof(argv[2]) : 500.0;
  const bool tcp = argc > 3 && std::strcmp(argv[3], "tcp") == 0;
  const SystemClock clock;
  const Logger log("bench_hop", LogLevel::warning);
  v1::Envelope full = full_frame();
  v1::Envelope nearly_empty;
  nearly_empty.mutable_tracking()->set_publish_time_ns(now_ns());

  // The bare socket, with as many bytes.
  int pair[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET, 0, pair) != 0) return 1;
  Collector bare;
  std::thread bare_receiver([&] {
    std::vector<char> bytes(full.ByteSizeLong() + 64);
    for (;;) {
      const ssize_t size = recv(pair[1], bytes.data(), bytes.size(), 0);
      if (size <= 8) return;
      std::int64_t sent = 0;
      std::memcpy(&sent, bytes.data(), sizeof(sent));
      bare.add(now_ns() - sent);
    }
  });

  // A ping: the same bytes come back at once.
  int ping_pair[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ping_pair) != 0) return 1;
  std::thread echo([&] {
    std::vector<char> bytes(full.ByteSizeLong() + 64);
    for (;;) {
      const ssize_t size = recv(ping_pair[1], bytes.data(), bytes.size(), 0);
      if (size <= 0) return;
      static_cast<void>(!send(ping_pair[1], bytes.data(), static_cast<std::size_t>(size), 0));
    }
  });

  // Ours: the server's I/O thread beside the publishing one, the client's own thread.
  boost::asio::io_context io;
  auto work = boost::asio::make_work_guard(io);
  std::thread io_thread([&] { io.run(); });
  std::mutex joined_mutex;
  std::condition_variable joined;
  net::ConnectionPtr subscriber;
  net::ServerEvents events;
  events.on_join = [&](const net::ConnectionPtr& connection) {
    const std::lock_guard lock(joined_mutex);
    subscriber = connection;
    joined.notify_all();
    return Status();
  };
  const std::string where =
      tcp ? std::string("tcp:127.0.0.1:0") : fmt::format("unix:/tmp/handloft-bench-hop-{}.sock", getpid());
  auto server = net::MessageServer::listen(io.get_executor(), net::parse_endpoint(where).value(), {}, events,
                                           clock, log);
  if (!server) {
    fmt::print(stderr, "{}\n", server.error().describe());
    return 1;
  }
  Collector ours;
  net::ClientEvents client_events;
  client_events.on_message = [&](v1::Envelope& message) {
    ours.add(now_ns() - message.tracking().publish_time_ns());
  };
  net::ClientOptions client_options;
  client_options.role = v1::ROLE_SUBSCRIBER;
  auto client = net::MessageClient::connect((*server)->endpoint(), client_options, client_events, clock, log);
  if (!client) {
    fmt::print(stderr, "{}\n", client.error().describe());
    return 1;
  }
  {
    std::unique_lock lock(joined_mutex);
    joined.wait(lock, [&] { return subscriber != nullptr; });
  }

  const auto compare = [&](const char* what, v1::Envelope& envelope) {
    const std::size_t payload_bytes = envelope.ByteSizeLong();
    std::vector<std::int64_t> all_bare, all_ping, all_ours;
    for (int round = 0; round < rounds; ++round) {
      std::vector<char> bytes(std::max<std::size_t>(payload_bytes, 9));
      paced(count, rate_hz, [&] {
        const std::int64_t sent = now_ns();
        std::memcpy(bytes.data(), &sent, sizeof(sent));
        static_cast<void>(!send(pair[0], bytes.data(), bytes.size(), 0));
      });
      const auto bare_round = bare.wait_for(static_cast<std::size_t>(count));
      all_bare.insert(all_bare.end(), bare_round.begin(), bare_round.end());
      paced(count, rate_hz, [&] {
        const std::int64_t sent = now_ns();
        static_cast<void>(!send(ping_pair[0], bytes.data(), bytes.size(), 0));
        static_cast<void>(!recv(ping_pair[0], bytes.data(), bytes.size(), 0));
        all_ping.push_back(now_ns() - sent);
      });
      paced(count, rate_hz, [&] {
        envelope.mutable_tracking()->set_publish_time_ns(now_ns());
        subscriber->send_latest({1, ""}, net::encode_frame(envelope).value());
      });
      const auto our_round = ours.wait_for(static_cast<std::size_t>(count));
      all_ours.insert(all_ours.end(), our_round.begin(), our_round.end());
    }
    const Statistics bare_us = statistics(all_bare);
    const Statistics ping_us = statistics(all_ping);
    const Statistics our_us = statistics(all_ours);
    fmt::print("{} of {} bytes, {} times at {} Hz\n", what, payload_bytes, all_ours.size(), rate_hz);
    const auto line = [](const char* name, const Statistics& us) {
      fmt::print("  {:32} median {:6.1f} us   p99 {:6.1f} us\n", name, us.p50_us, us.p99_us);
    };
    line("bare SOCK_SEQPACKET, one way", bare_us);
    line("bare SOCK_SEQPACKET, ping", ping_us);
    line(tcp ? "publish to receive, tcp" : "publish to receive, unix", our_us);
    fmt::print("  ratio of medians: {:.2f} to one way, {:.2f} to the ping\n", our_us.p50_us / bare_us.p50_us,
               our_us.p50_us / ping_us.p50_us);
  };
  compare("nearly empty frame", nearly_empty);
  compare("full frame", full);

  shutdown(pair[0], SHUT_RDWR);
  bare_receiver.join();
  shutdown(ping_pair[0], SHUT_RDWR);
  echo.join();
  client->reset();
  (*server)->stop();
  work.reset();
  subscriber.reset();
  io_thread.join();
  close(pair[0]);
  close(pair[1]);
  close(ping_pair[0]);
  close(ping_pair[1]);
  return 0;
}
