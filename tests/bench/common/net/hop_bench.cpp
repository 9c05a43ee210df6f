// The local hop: from publishing a TrackingFrame to its callback in a subscriber, against a bare
// SOCK_SEQPACKET socket between two threads, in the same run, in turns, at the same pace. Prints medians,
// 99th percentiles and their ratio; the promise is a ratio of medians <= 1.5.
//
//   hop_bench [messages per round] [rate in Hz] [unix|tcp]

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

// A full frame: head with covariance, five fingertips, three cameras.
v1::Envelope full_frame() {
  v1::Envelope envelope;
  v1::TrackingFrame& frame = *envelope.mutable_tracking();
  v1::HeadState& head = *frame.mutable_head();
  head.set_state(v1::TRACKING_TRACKED);
  head.mutable_world_from_head()->mutable_position()->set_x(0.1);
  head.mutable_world_from_head()->mutable_orientation()->set_w(1);
  for (int i = 0; i < 36; ++i) head.add_covariance(1e-6 * i);
  v1::HandState& hand = *frame.add_hands();
  for (int finger = 0; finger < 5; ++finger) {
    v1::FingertipState& tip = *hand.add_fingertips();
    tip.set_finger(static_cast<v1::Finger>(finger));
    tip.mutable_position()->set_x(0.01 * finger);
    tip.mutable_velocity()->set_y(0.02);
    for (int i = 0; i < 9; ++i) tip.add_covariance(1e-7 * i);
  }
  for (int i = 0; i < 3; ++i) {
    v1::CameraState& camera = *frame.add_cameras();
    camera.set_name("camera");
    camera.mutable_world_from_camera()->mutable_orientation()->set_w(1);
    for (int k = 0; k < 5; ++k) camera.add_distortion(0.01 * k);
  }
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
  const Logger log("hop_bench", LogLevel::warning);
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
      tcp ? std::string("tcp:127.0.0.1:0") : fmt::format("unix:/tmp/handloft-hop-bench-{}.sock", getpid());
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
    std::vector<std::int64_t> all_bare, all_ours;
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
        envelope.mutable_tracking()->set_publish_time_ns(now_ns());
        subscriber->send_latest({1, ""}, net::encode_frame(envelope).value());
      });
      const auto our_round = ours.wait_for(static_cast<std::size_t>(count));
      all_ours.insert(all_ours.end(), our_round.begin(), our_round.end());
    }
    const Statistics bare_us = statistics(all_bare);
    const Statistics our_us = statistics(all_ours);
    fmt::print("{} of {} bytes, {} times at {} Hz\n", what, payload_bytes, all_ours.size(), rate_hz);
    fmt::print("  bare SOCK_SEQPACKET  median {:6.1f} us   p99 {:6.1f} us\n", bare_us.p50_us, bare_us.p99_us);
    fmt::print("  handloft hop, {:4}   median {:6.1f} us   p99 {:6.1f} us\n", tcp ? "tcp" : "unix",
               our_us.p50_us, our_us.p99_us);
    fmt::print("  ratio of medians     {:.2f}\n", our_us.p50_us / bare_us.p50_us);
  };
  compare("nearly empty frame", nearly_empty);
  compare("full frame", full);

  shutdown(pair[0], SHUT_RDWR);
  bare_receiver.join();
  client->reset();
  (*server)->stop();
  work.reset();
  subscriber.reset();
  io_thread.join();
  close(pair[0]);
  close(pair[1]);
  return 0;
}
