// C3: how long from a Join until a client has all of a large scene, and what the others feel of it. A real
// server process on a unix socket; a scene of some 50 MiB on the wire (points, fitted and sculpted surfaces);
// one client after another joins, reads all and leaves, while an editor lays points 60 times a second.
//
//   bench_session_join [--mib 50] [--joins 100] [--at-once 1]

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/core.h>

#include "common/net/message_client.h"
#include "server-model/session/remote_target.h"
#include "tests/bench/server-model/session/load_figures.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;

struct JoinOptions {
  double mib = 50;
  int joins = 100;
  int at_once = 1;
};

constexpr int sculpted_surfaces = 12;
constexpr int fitted_shapes = 12;
constexpr std::uint32_t points_of_a_cloud = 50'000;
constexpr double bytes_of_a_point = 14;
constexpr double edits_per_s = 60;
constexpr auto patience = 60s;

std::runtime_error failed(const Error& error) {
  return std::runtime_error(error.describe());
}

/// What came of each entity: complete when it is as much as somebody has who has been here for long.
struct Received {
  struct Entity {
    std::uint32_t points = 0;
    bool surface = false;
    auto operator<=>(const Entity&) const = default;
  };
  std::map<std::string, Entity> entities;
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;

  void take(const v1::Envelope& envelope) {
    if (!envelope.has_snapshot() && !envelope.has_delta()) return;
    bytes += envelope.ByteSizeLong() + net::frame_header_bytes;
    ++messages;
    for (const auto& state :
         envelope.has_snapshot() ? envelope.snapshot().entities() : envelope.delta().changed()) {
      Entity& entity = entities[state.id()];
      if (state.has_points()) entity.points = state.points().total();
      if (state.has_surface()) entity.surface = true;
    }
  }
  bool has(const Received& all) const {
    return std::all_of(all.entities.begin(), all.entities.end(), [&](const auto& item) {
      const auto found = entities.find(item.first);
      return found != entities.end() && found->second.points >= item.second.points &&
             found->second.surface >= item.second.surface;
    });
  }
};

net::SyncClient connect(const net::Endpoint& endpoint, const Clock& clock) {
  net::ClientOptions options;
  options.role = v1::ROLE_VIEWER;
  options.name = "late";
  auto client = net::SyncClient::connect(endpoint, options, clock);
  if (!client) throw failed(client.error());
  return *std::move(client);
}

void ask_to_join(net::SyncClient& client) {
  v1::Envelope envelope;
  envelope.mutable_join();
  if (const Status sent = client.send(envelope); !sent) throw failed(sent.error());
}

/// Lays points until it is destroyed, and keeps how long each took to be answered.
class Editor {
 public:
  Editor(const net::Endpoint& endpoint, const Clock& clock) : clock_(clock) {
    net::ClientOptions options;
    options.role = v1::ROLE_EDITOR;
    options.name = "editor";
    net::ClientEvents events;
    events.on_message = [this](v1::Envelope& envelope) {
      if (!envelope.has_ack()) return;
      const std::int64_t now = to_ns(clock_.now());
      const std::lock_guard lock(mutex_);
      const auto sent = sent_.find(envelope.ack().request());
      if (sent == sent_.end()) return;
      latencies_.add(1e-6 * static_cast<double>(now - sent->second));
      sent_.erase(sent);
    };
    auto client = net::MessageClient::connect(endpoint, std::move(options), std::move(events), clock,
                                              Logger("editor", LogLevel::off));
    if (!client) throw failed(client.error());
    client_ = *std::move(client);
    v1::Envelope join;
    join.mutable_join();
    (void)client_->send(join);
    thread_ = std::thread([this] { run(); });
  }
  ~Editor() {
    ends_ = true;
    thread_.join();
  }
  Latencies take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(latencies_, {});
  }

 private:
  void run() {
    auto next = std::chrono::steady_clock::now();
    for (std::uint64_t request = 1; !ends_; ++request) {
      v1::Envelope envelope;
      envelope.mutable_submit()->set_request(request);
      auto& add = *envelope.mutable_submit()->mutable_operation()->mutable_add_points();
      add.set_entity("drawn");
      add.add_points()->mutable_position()->set_x(1e-4 * static_cast<double>(request % 1000));
      {
        const std::lock_guard lock(mutex_);
        sent_[request] = to_ns(clock_.now());
      }
      (void)client_->send(envelope);
      next += std::chrono::microseconds(static_cast<int>(1e6 / edits_per_s));
      std::this_thread::sleep_until(next);
    }
  }

  const Clock& clock_;
  std::atomic<bool> ends_ = false;
  std::mutex mutex_;
  std::map<std::uint64_t, std::int64_t> sent_;
  Latencies latencies_;
  std::unique_ptr<net::MessageClient> client_;
  std::thread thread_;
};

class Joins {
 public:
  explicit Joins(const JoinOptions& options) : options_(options) {
    server_ =
        std::make_unique<test::Process>(std::vector<std::string>{test::program("handloft-modeld").string(),
                                                                 "serve", "--listen", endpoint().to_string()},
                                        folder_.path() / "log");
    if (!server_->read_line(20s)) throw std::runtime_error(server_->error_output());
    make_scene();
    read_all_there_is();
  }

  void run() {
    Editor editor(endpoint(), clock_);
    const auto alone_for = std::chrono::seconds(10);
    std::this_thread::sleep_for(alone_for);
    const Latencies alone = editor.take();
    const double cpu = cpu_s(server_->pid());
    std::mutex mutex;
    Latencies joins, first_messages;
    std::atomic<int> left = options_.joins;
    std::vector<std::thread> threads;
    threads.reserve(static_cast<std::size_t>(options_.at_once));
    for (int i = 0; i < options_.at_once; ++i) {
      threads.emplace_back([&] {
        while (left-- > 0) {
          const auto [first_ms, all_ms] = join();
          const std::lock_guard lock(mutex);
          first_messages.add(first_ms);
          joins.add(all_ms);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    const Latencies meanwhile = editor.take();
    const auto print = [](const char* what, const Latencies& its) {
      fmt::print("    {:32} p50 {:7.2f} ms, p99 {:7.2f} ms, most {:7.2f} ms ({})\n", what,
                 its.percentile(0.5), its.percentile(0.99), its.most(), its.count());
    };
    fmt::print("{} joins, {} at once, of {:.1f} MiB in {} messages ({} entities)\n", options_.joins,
               options_.at_once, static_cast<double>(all_.bytes) / (1 << 20), all_.messages,
               all_.entities.size());
    print("join -> the first message", first_messages);
    print("join -> all of the scene", joins);
    print("editor's answers, nobody joins", alone);
    print("editor's answers meanwhile", meanwhile);
    fmt::print("    the server takes {:.0f} ms of a core for a join; resident {:.0f} MiB\n",
               1000 * (cpu_s(server_->pid()) - cpu) / options_.joins, rss_mib(server_->pid()));
  }

 private:
  net::Endpoint endpoint() const {
    return net::parse_endpoint("unix:" + (folder_.path() / "model.sock").string()).value();
  }

  void make_scene() {
    RemoteTargetOptions who;
    who.role = v1::ROLE_EDITOR;
    auto target = RemoteTarget::connect(endpoint(), clock_, who);
    if (!target) throw failed(target.error());
    const auto submit = [&](const v1::Operation& operation) {
      const auto done = target->submit(operation);
      if (!done) throw failed(done.error());
    };
    v1::Operation drawn;
    drawn.mutable_create_dual_shape()->set_id("drawn");
    submit(drawn);
    for (int i = 0; i < sculpted_surfaces; ++i) {
      v1::Operation operation;
      auto& create = *operation.mutable_create_sculpt_surface();
      create.set_id("sheet" + std::to_string(i));
      create.mutable_rectangle()->set_width_m(0.4);
      create.mutable_rectangle()->set_depth_m(0.3);
      create.set_control_u(20);
      create.set_control_v(20);
      submit(operation);
    }
    const auto clouds =
        static_cast<int>(std::ceil(options_.mib * (1 << 20) / (bytes_of_a_point * points_of_a_cloud)));
    for (int i = 0; i < clouds; ++i) {
      const std::string id = "cloud" + std::to_string(i);
      v1::Operation operation;
      auto& add = *operation.mutable_add_points();
      add.set_entity(id);
      add.mutable_create();
      for (std::uint32_t k = 0; k < points_of_a_cloud; ++k) {
        v1::Point& point = *add.add_points();
        const double x = 0.001 * (k % 223) - 0.1, y = 0.001 * std::floor(k / 223.0) - 0.1;
        point.mutable_position()->set_x(x);
        point.mutable_position()->set_y(y);
        point.mutable_position()->set_z(0.1 + x * x - 0.5 * x * y + 0.001 * std::sin(100.0 * i + k));
        point.set_pressure(0.001 * (k % 1000));
      }
      submit(operation);
      if (i >= fitted_shapes) continue;
      v1::Operation fit;
      fit.mutable_fit()->set_entity(id);
      fit.mutable_fit()->set_degree(4);
      submit(fit);
      v1::Operation both;
      both.mutable_set_representation()->set_entity(id);
      both.mutable_set_representation()->set_representation(v1::REPRESENTATION_BOTH);
      submit(both);
    }
  }

  /// Until all surfaces are tessellated: then nothing more comes.
  void read_all_there_is() {
    net::SyncClient client = connect(endpoint(), clock_);
    ask_to_join(client);
    Received had;
    while (true) {
      auto envelope = client.receive(3000ms);
      if (!envelope) break;
      had.take(*envelope);
    }
    all_ = had;
    // Its size as it comes in one go.
    net::SyncClient again = connect(endpoint(), clock_);
    ask_to_join(again);
    Received received;
    while (!received.has(had)) {
      auto envelope = again.receive(patience);
      if (!envelope) throw failed(envelope.error());
      received.take(*envelope);
    }
    all_ = received;
  }

  std::pair<double, double> join() {
    net::SyncClient client = connect(endpoint(), clock_);
    const TimePoint asked = clock_.now();
    ask_to_join(client);
    Received received;
    double first_ms = 0;
    while (!received.has(all_)) {
      auto envelope = client.receive(patience);
      if (!envelope) throw failed(envelope.error());
      received.take(*envelope);
      if (received.messages == 1 && first_ms == 0) first_ms = 1e3 * to_seconds(clock_.now() - asked);
    }
    return {first_ms, 1e3 * to_seconds(clock_.now() - asked)};
  }

  const JoinOptions options_;
  test::TemporaryDirectory folder_;
  SystemClock clock_;
  std::unique_ptr<test::Process> server_;
  Received all_;
};

}  // namespace
}  // namespace handloft::session

int main(int count, char** words) {
  using namespace handloft::session;
  JoinOptions options;
  for (int i = 1; i < count; i += 2) {
    const std::string word = words[i];
    const double value = i + 1 < count ? std::atof(words[i + 1]) : 0;
    if (word == "--mib") {
      options.mib = value;
    } else if (word == "--joins") {
      options.joins = std::max(1, static_cast<int>(value));
    } else if (word == "--at-once") {
      options.at_once = std::max(1, static_cast<int>(value));
    } else {
      std::cerr << "found " << word << ", expected --mib, --joins or --at-once\n";
      return 2;
    }
  }
  try {
    Joins(options).run();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
