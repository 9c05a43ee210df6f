// L1, L2: many clients of one real server process. Each tells of its head 60 times a second; one drags a
// sculpted surface by an icon with a hand at 60 frames a second, another lays points ten times a second. How
// long until every client has seen a frame and an operation; then the same while one client, and while ten,
// read nothing at all: what changes for the others, and what memory the server keeps for them.
//
//   build/release/bin/bench_session_load --clients 32 --seconds 20 [--store] [--rate 60] [--surface 12]

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/core.h>

#include "common/net/message_client.h"
#include "server-model/session/remote_target.h"
#include "tests/support/hand_script.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;

struct LoadOptions {
  int clients = 32;
  double seconds = 20;  ///< Of each phase.
  double rate = 60;     ///< Of presence and hand frames, each second.
  int control = 12;     ///< Control points of the surface in each direction.
  bool store = false;
};

constexpr double operations_per_s = 10;
constexpr int most_stalled = 10;
const Vector3d held_at(0.05, 0.02, 0.1);

void must(const Status& status, const char* what) {
  if (!status) throw std::runtime_error(std::string(what) + ": " + status.error().describe());
}

/// One viewer, with what it saw and when.
class Client {
 public:
  struct Seen {
    std::uint64_t sequence = 0;
    std::int64_t capture_ns = 0;
    std::int64_t at_ns = 0;
  };

  Client(const net::Endpoint& endpoint, int number, const Clock& clock) : clock_(clock) {
    net::ClientOptions options;
    options.role = v1::ROLE_EDITOR;
    options.name = "client " + std::to_string(number);
    net::ClientEvents events;
    events.on_message = [this](v1::Envelope& envelope) { read(envelope); };
    auto client = net::MessageClient::connect(endpoint, std::move(options), std::move(events), clock,
                                              Logger("load", LogLevel::off));
    if (!client) throw std::runtime_error(client.error().describe());
    client_ = *std::move(client);
    v1::Envelope join;
    join.mutable_join();
    must(client_->send(join), "join");
  }
  void send(const v1::Envelope& envelope) {
    if (!client_->send(envelope)) ++unsent_;
  }
  void stall(bool yes) { stalled_ = yes; }
  std::vector<Seen> take_seen() {
    const std::lock_guard lock(mutex_);
    return std::exchange(seen_, {});
  }
  std::vector<Seen> acks() {
    const std::lock_guard lock(mutex_);
    return std::exchange(acks_, {});
  }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t presences() const { return presences_; }
  std::uint64_t unsent() const { return unsent_; }

 private:
  void read(const v1::Envelope& envelope) {
    while (stalled_) std::this_thread::sleep_for(5ms);
    const std::int64_t now = to_ns(clock_.now());
    bytes_ += envelope.ByteSizeLong() + net::frame_header_bytes;
    if (envelope.has_presence()) ++presences_;
    const std::lock_guard lock(mutex_);
    if (envelope.has_delta()) {
      seen_.push_back({envelope.delta().sequence(), envelope.delta().capture_time_ns(), now});
    } else if (envelope.has_ack()) {
      acks_.push_back({envelope.ack().sequence(), static_cast<std::int64_t>(envelope.ack().request()), now});
    }
  }

  const Clock& clock_;
  std::atomic<bool> stalled_ = false;
  std::atomic<std::uint64_t> bytes_ = 0, presences_ = 0, unsent_ = 0;
  std::mutex mutex_;
  std::vector<Seen> seen_, acks_;  ///< Of an ack: capture_ns is its request.
  std::unique_ptr<net::MessageClient> client_;
};

struct Percentiles {
  std::size_t count = 0;
  double p50 = 0, p99 = 0, most = 0;
};
Percentiles percentiles(std::vector<double> milliseconds) {
  if (milliseconds.empty()) return {};
  std::sort(milliseconds.begin(), milliseconds.end());
  const auto at = [&](double part) {
    return milliseconds[std::min(milliseconds.size() - 1,
                                 static_cast<std::size_t>(part * static_cast<double>(milliseconds.size())))];
  };
  return {milliseconds.size(), at(0.5), at(0.99), milliseconds.back()};
}

double rss_mib(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
  std::uint64_t size = 0, resident = 0;
  file >> size >> resident;
  return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

double cpu_s(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string word;
  double ticks = 0;
  for (int i = 1; file >> word && i <= 15; ++i) {
    if (i == 14 || i == 15) ticks += std::atof(word.c_str());
  }
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

double own_cpu_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

class Load {
 public:
  explicit Load(const LoadOptions& options) : options_(options) {
    std::vector<std::string> arguments{test::program("handloft-modeld").string(), "serve", "--listen",
                                       endpoint().to_string()};
    if (options.store) {
      arguments.emplace_back("--store");
      arguments.push_back((folder_.path() / "model.handloft").string());
    }
    server_ = std::make_unique<test::Process>(arguments, folder_.path() / "log");
    if (!server_->read_line(20s)) throw std::runtime_error(server_->error_output());
    make_scene();
    for (int i = 0; i < options.clients; ++i)
      clients_.push_back(std::make_unique<Client>(endpoint(), i, clock_));
    take_hold();
  }

  void phase(const std::string& name, int stalled) {
    const double resident = rss_mib(server_->pid());
    const double cpu = cpu_s(server_->pid()), own = own_cpu_s();
    for (int i = 0; i < stalled; ++i)
      clients_.at(clients_.size() - 1 - static_cast<std::size_t>(i))->stall(true);
    std::this_thread::sleep_for(500ms);
    for (const auto& client : clients_) (void)client->take_seen();
    (void)clients_.at(1)->acks();
    std::uint64_t bytes = clients_.at(2)->bytes(), presences = clients_.at(2)->presences();
    sent_.clear();
    drive();
    std::this_thread::sleep_for(500ms);
    bytes = clients_.at(2)->bytes() - bytes;
    presences = clients_.at(2)->presences() - presences;
    report(name, stalled, bytes, presences);
    fmt::print("    server {:.0f} % of a core, clients {:.0f} %; resident {:.1f} -> {:.1f} MiB\n",
               100 * (cpu_s(server_->pid()) - cpu) / options_.seconds,
               100 * (own_cpu_s() - own) / options_.seconds, resident, rss_mib(server_->pid()));
    for (const auto& client : clients_) client->stall(false);
    std::this_thread::sleep_for(1s);
  }

 private:
  struct Operation {
    std::int64_t at_ns = 0;
    std::uint64_t request = 0;
  };

  net::Endpoint endpoint() const {
    return net::parse_endpoint("unix:" + (folder_.path() / "model.sock").string()).value();
  }

  void make_scene() {
    auto target = RemoteTarget::connect(endpoint(), clock_);
    if (!target) throw std::runtime_error(target.error().describe());
    const auto submit = [&](const v1::Operation& operation) {
      const auto done = target->submit(operation);
      if (!done) throw std::runtime_error(done.error().describe());
    };
    v1::Operation sheet;
    auto& create = *sheet.mutable_create_sculpt_surface();
    create.set_id("sheet");
    create.mutable_rectangle()->mutable_pose()->mutable_position()->set_z(held_at.z());
    create.mutable_rectangle()->mutable_pose()->mutable_orientation()->set_w(1);
    create.mutable_rectangle()->set_width_m(0.4);
    create.mutable_rectangle()->set_depth_m(0.3);
    create.set_control_u(static_cast<std::uint32_t>(options_.control));
    create.set_control_v(static_cast<std::uint32_t>(options_.control));
    submit(sheet);
    for (const Vector3d& place :
         {held_at, Vector3d(-0.12, 0, held_at.z()), Vector3d(0.12, 0.1, held_at.z())}) {
      v1::Operation icon;
      auto& add = *icon.mutable_add_icon();
      add.set_entity("sheet");
      v1::Vec3& at = *add.add_places();
      at.set_x(place.x());
      at.set_y(place.y());
      at.set_z(place.z());
      add.set_role(v1::ICON_CONSTRAINT);
      add.set_property(v1::ICON_POSITION);
      add.add_sensors("hand");
      submit(icon);
    }
    v1::Operation shape;
    shape.mutable_create_dual_shape()->set_id("points");
    submit(shape);
  }

  void show(v1::TrackingFrame frame) {
    v1::Envelope envelope;
    frame.set_capture_time_ns(to_ns(clock_.now()));
    *envelope.mutable_tracking() = std::move(frame);
    clients_.at(0)->send(envelope);
  }

  void take_hold() {
    std::this_thread::sleep_for(500ms);
    for (int i = 0; i < 20; ++i) {
      show(i < 10 ? script_.resting(held_at + Vector3d(0, 0, 0.02))
                  : script_.closed(held_at + Vector3d(0, 0, 0.02)));
      std::this_thread::sleep_for(17ms);
    }
  }

  /// Everybody in turn, so that the load is even.
  void drive() {
    const auto begin = std::chrono::steady_clock::now();
    const auto turns = static_cast<std::uint64_t>(options_.seconds * options_.rate);
    const double turn_s = 1 / options_.rate;
    const auto every = static_cast<std::uint64_t>(options_.rate / operations_per_s);
    for (std::uint64_t turn = 0; turn < turns; ++turn) {
      for (std::size_t i = 0; i < clients_.size(); ++i) {
        const double part = static_cast<double>(i) / static_cast<double>(clients_.size());
        std::this_thread::sleep_until(
            begin + std::chrono::duration_cast<std::chrono::nanoseconds>(
                        std::chrono::duration<double>((static_cast<double>(turn) + part) * turn_s)));
        if (i == 0) {
          const double angle = 2 * std::numbers::pi * static_cast<double>(turn) * turn_s;
          show(script_.closed(held_at + Vector3d(0.02 * std::sin(angle), 0.01 * std::sin(2 * angle),
                                                 0.02 + 0.02 * (1 - std::cos(angle)))));
          continue;
        }
        v1::Envelope envelope;
        v1::Presence& presence = *envelope.mutable_presence();
        presence.mutable_head()->set_state(v1::TRACKING_TRACKED);
        presence.mutable_head()->mutable_world_from_head()->mutable_position()->set_z(
            0.3 + 0.1 * std::sin(0.1 * static_cast<double>(turn)));
        presence.mutable_head()->mutable_world_from_head()->mutable_orientation()->set_w(1);
        clients_[i]->send(envelope);
        if (i == 1 && turn % every == 0) lay_point();
      }
    }
  }

  void lay_point() {
    v1::Envelope envelope;
    envelope.mutable_submit()->set_request(++last_request_);
    auto& request = *envelope.mutable_submit()->mutable_operation()->mutable_add_points();
    request.set_entity("points");
    v1::Point& point = *request.add_points();
    point.mutable_position()->set_x(1e-4 * static_cast<double>(last_request_ % 1000));
    point.set_pressure(0.5);
    sent_.push_back({to_ns(clock_.now()), last_request_});
    clients_.at(1)->send(envelope);
  }

  void report(const std::string& name, int stalled, std::uint64_t bytes, std::uint64_t presences) {
    std::map<std::uint64_t, std::uint64_t> sequence_of;
    std::vector<double> answers;
    for (const Client::Seen& ack : clients_.at(1)->acks()) {
      sequence_of[static_cast<std::uint64_t>(ack.capture_ns)] = ack.sequence;
      for (const Operation& operation : sent_) {
        if (operation.request == static_cast<std::uint64_t>(ack.capture_ns))
          answers.push_back(1e-6 * static_cast<double>(ack.at_ns - operation.at_ns));
      }
    }
    std::vector<double> frames, operations;
    std::size_t missed = 0;
    // The same clients in every phase: those that never stall.
    const std::size_t watched = clients_.size() - std::min<std::size_t>(most_stalled, clients_.size() - 3);
    for (std::size_t i = 0; i < watched; ++i) {
      const auto seen = clients_[i]->take_seen();
      std::int64_t last = 0;
      for (const Client::Seen& one : seen) {
        if (one.capture_ns <= last) continue;
        last = one.capture_ns;
        frames.push_back(1e-6 * static_cast<double>(one.at_ns - one.capture_ns));
      }
      for (const Operation& operation : sent_) {
        const auto sequence = sequence_of.find(operation.request);
        if (sequence == sequence_of.end()) {
          ++missed;
          continue;
        }
        const auto first = std::find_if(seen.begin(), seen.end(), [&](const Client::Seen& one) {
          return one.sequence >= sequence->second;
        });
        if (first == seen.end()) {
          ++missed;
        } else {
          operations.push_back(1e-6 * static_cast<double>(first->at_ns - operation.at_ns));
        }
      }
    }
    const auto words = [](const char* what, const Percentiles& its) {
      fmt::print("    {:28} p50 {:7.2f} ms, p99 {:7.2f} ms, most {:7.2f} ms ({})\n", what, its.p50, its.p99,
                 its.most, its.count);
    };
    fmt::print("{}: {} clients, {} of them stalled\n", name, clients_.size(), stalled);
    words("operation -> every client", percentiles(operations));
    words("operation -> its answer", percentiles(answers));
    words("hand's frame -> every client", percentiles(frames));
    fmt::print("    one client gets {:.2f} MB/s and {:.0f} presences a second; {} not seen\n",
               1e-6 * static_cast<double>(bytes) / options_.seconds,
               static_cast<double>(presences) / options_.seconds, missed);
    std::fflush(stdout);
  }

  const LoadOptions options_;
  test::TemporaryDirectory folder_;
  SystemClock clock_;
  std::unique_ptr<test::Process> server_;
  std::vector<std::unique_ptr<Client>> clients_;
  test::HandScript script_;
  std::vector<Operation> sent_;
  std::uint64_t last_request_ = 0;
};

}  // namespace
}  // namespace handloft::session

int main(int count, char** words) {
  using namespace handloft::session;
  LoadOptions options;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    if (word == "--store") {
      options.store = true;
      continue;
    }
    const double value = i + 1 < count ? std::atof(words[++i]) : 0;
    if (word == "--clients") {
      options.clients = std::max(4, static_cast<int>(value));
    } else if (word == "--seconds") {
      options.seconds = value;
    } else if (word == "--rate") {
      options.rate = value;
    } else if (word == "--surface") {
      options.control = static_cast<int>(value);
    } else {
      std::cerr << "found " << word << ", expected --clients, --seconds, --rate, --surface or --store\n";
      return 2;
    }
  }
  try {
    Load load(options);
    load.phase("nobody stalls", 0);
    load.phase("one stalls", 1);
    load.phase("ten stall", std::min(most_stalled, options.clients - 3));
    load.phase("nobody stalls again", 0);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
