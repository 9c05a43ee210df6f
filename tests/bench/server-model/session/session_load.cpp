// L1, L2: many clients of one real server process, in one model or in several. Each tells of its head 60
// times a second; in each model one drags a sculpted surface by an icon with a hand at 60 frames a second,
// another lays points ten times a second. How long until every client of the model has seen a frame and an
// operation?
//
//   bench_session_load --clients 32 --seconds 60 [--store] [--rate 60] [--operations 10] [--surface 12]
//                      [--no-drag]
//   bench_session_load --clients 200 --models 20 --seconds 3600 --fill 10500 --steady
//                                                      L1, with the slopes of what is resident of the server
//                                                      and of what it holds of its heap. They grow
//                                                      until the histories have all the steps that they keep
//                                                      (so they are filled first), and with the document, but
//                                                      for --steady: operations that give new names
//   bench_session_load --clients 32 --seconds 2 --rounds 60      L2: while nobody, one and ten read nothing
//
// The last one takes turns among the three, since what else the machine does changes more from minute to
// minute than a stalled client changes; it tells the ratio of the 99th percentiles of all rounds together,
// with the 95 % interval of a bootstrap over rounds.

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
#include "tests/bench/server-model/session/load_figures.h"
#include "tests/support/hand_script.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;

struct LoadOptions {
  int clients = 32;
  double seconds = 20;  ///< Of each round, or of the phase.
  double rate = 60;     ///< Of presence and hand frames, each second.
  int control = 12;     ///< Control points of the surface in each direction.
  int models = 1;
  int fill = 0;    ///< Steps of history to begin with: with Limits::max_history_steps it grows no more.
  int rounds = 0;  ///< 0: one phase in which nobody stalls.
  double operations_per_s = 10;  ///< In each model.
  bool drags = true;
  bool store = false;
  bool steady = false;  ///< Operations leave the documents as large as they are.
};

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

  Client(const net::Endpoint& endpoint, int number, const std::string& model, const Clock& clock)
      : clock_(clock) {
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
    join.mutable_join()->set_model(model);
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

/// Of one phase.
struct Figures {
  Latencies operations, answers, frames;
  std::size_t missed = 0;
  void add(const Figures& others) {
    operations.add(others.operations);
    answers.add(others.answers);
    frames.add(others.frames);
    missed += others.missed;
  }
};

void print(const char* what, const Latencies& its) {
  fmt::print("    {:28} p50 {:7.2f} ms, p99 {:7.2f} ms, most {:7.2f} ms ({})\n", what, its.percentile(0.5),
             its.percentile(0.99), its.most(), its.count());
}

void print(const Figures& its) {
  print("operation -> every client", its.operations);
  print("operation -> its answer", its.answers);
  print("hand's frame -> every client", its.frames);
  if (its.missed > 0) fmt::print("    {} operations not seen in time\n", its.missed);
}

class Load {
 public:
  explicit Load(const LoadOptions& options) : options_(options), sent_(models()) {
    const std::filesystem::path models_folder = folder_.path() / "models";
    std::filesystem::create_directories(models_folder);
    std::vector<std::string> arguments{test::program("handloft-modeld").string(),
                                       "serve",
                                       "--listen",
                                       endpoint().to_string(),
                                       "--metrics",
                                       metrics().to_string()};
    if (options.models > 1) {
      arguments.emplace_back("--models");
      arguments.push_back(models_folder.string());
    } else if (options.store) {
      arguments.emplace_back("--store");
      arguments.push_back((folder_.path() / "model.handloft").string());
    }
    server_ = std::make_unique<test::Process>(arguments, folder_.path() / "log");
    if (!server_->read_line(20s)) throw std::runtime_error(server_->error_output());
    for (std::size_t model = 0; model < models(); ++model) make_scene(name_of(model));
    for (int i = 0; i < options.clients; ++i) {
      clients_.push_back(
          std::make_unique<Client>(endpoint(), i, name_of(static_cast<std::size_t>(i) % models()), clock_));
    }
    take_hold();
  }

  /// One phase, as long as the options say, in which so many read nothing.
  Figures measure(int stalled) {
    for (int i = 0; i < stalled; ++i)
      clients_.at(clients_.size() - 1 - static_cast<std::size_t>(i))->stall(true);
    std::this_thread::sleep_for(settles_for);
    for (const auto& client : clients_) {
      (void)client->take_seen();
      (void)client->acks();
    }
    for (auto& operations : sent_) operations.clear();
    began_ns_ = to_ns(clock_.now());
    drive();
    std::this_thread::sleep_for(settles_for);
    Figures figures = read_figures();
    for (const auto& client : clients_) client->stall(false);
    if (stalled > 0) std::this_thread::sleep_for(settles_for);
    return figures;
  }

  void phase() {
    const double resident = rss_mib(server_->pid());
    const double cpu = cpu_s(server_->pid()), own = own_cpu_s();
    const std::uint64_t bytes = clients_.back()->bytes(), presences = clients_.back()->presences();
    resident_.clear();
    held_.clear();
    const Figures figures = measure(0);
    fmt::print("{} clients of {} models, {:.0f} s\n", clients_.size(), models(), options_.seconds);
    print(figures);
    fmt::print("    one client gets {:.2f} MB/s and {:.0f} presences a second\n",
               1e-6 * static_cast<double>(clients_.back()->bytes() - bytes) / options_.seconds,
               static_cast<double>(clients_.back()->presences() - presences) / options_.seconds);
    fmt::print("    server {:.0f} % of a core, clients {:.0f} %; resident {:.1f} -> {:.1f} MiB\n",
               100 * (cpu_s(server_->pid()) - cpu) / options_.seconds,
               100 * (own_cpu_s() - own) / options_.seconds, resident, rss_mib(server_->pid()));
    // What is filled once (histories, pools) is filled by then.
    for (auto& [what, seen] : {std::pair("resident", &resident_), std::pair("the heap held", &held_)}) {
      std::erase_if(*seen, [&](const auto& one) { return one.first < options_.seconds / 3; });
      if (seen->size() < 3) continue;
      const Slope slope = fitted_slope(*seen);
      fmt::print("    {} grows {:.2f} +- {:.2f} MiB/h over the last {:.0f} s, {:.1f} MiB at its end\n", what,
                 3600 * slope.per_s, 3600 * slope.standard_error, 2 * options_.seconds / 3,
                 seen->back().second);
    }
    std::fflush(stdout);
  }

  void rounds() {
    constexpr std::size_t kinds = 3;
    const int stalled[kinds] = {0, 1, std::min(most_stalled, options_.clients - 3)};
    std::vector<Latencies> operations[kinds], frames[kinds];
    Figures all[kinds];
    double most_resident[kinds] = {};
    for (int round = 0; round < options_.rounds; ++round) {
      for (std::size_t turn = 0; turn < kinds; ++turn) {
        const std::size_t kind = (turn + static_cast<std::size_t>(round)) % kinds;
        const Figures figures = measure(stalled[kind]);
        operations[kind].push_back(figures.operations);
        frames[kind].push_back(figures.frames);
        all[kind].add(figures);
        most_resident[kind] = std::max(most_resident[kind], rss_mib(server_->pid()));
      }
    }
    for (std::size_t kind = 0; kind < kinds; ++kind) {
      fmt::print("{} of {} clients stalled, {} rounds of {} s; resident {:.1f} MiB at most\n", stalled[kind],
                 clients_.size(), options_.rounds, options_.seconds, most_resident[kind]);
      print(all[kind]);
      if (kind == 0) continue;
      const auto ratio = [&](const char* what, const std::vector<Latencies>* its) {
        const Interval is = ratio_of_percentiles(its[kind], its[0], 0.99);
        fmt::print("    {:28} p99 x {:.3f} of that without, 95 %: {:.3f} to {:.3f}\n", what, is.middle,
                   is.low, is.high);
      };
      ratio("operation -> every client", operations);
      ratio("hand's frame -> every client", frames);
    }
    std::fflush(stdout);
  }

 private:
  struct Operation {
    std::int64_t at_ns = 0;
    std::uint64_t request = 0;
  };

  /// For what is on the way to come.
  static constexpr auto settles_for = 500ms;

  std::size_t models() const { return static_cast<std::size_t>(options_.models); }
  /// The clients are dealt out to the models; in each the first one drags and the second lays points.
  std::size_t model_of(std::size_t client) const { return client % models(); }
  bool drags(std::size_t client) const { return client < models(); }
  bool lays(std::size_t client) const { return client >= models() && client < 2 * models(); }
  Client& layer(std::size_t model) { return *clients_.at(models() + model); }
  std::string name_of(std::size_t model) const {
    return options_.models > 1 ? "model-" + std::to_string(model) : std::string();
  }

  net::Endpoint endpoint() const {
    return net::parse_endpoint("unix:" + (folder_.path() / "model.sock").string()).value();
  }

  net::Endpoint metrics() const {
    return net::parse_endpoint("unix:" + (folder_.path() / "metrics.sock").string()).value();
  }

  void make_scene(const std::string& model) {
    RemoteTargetOptions where;
    where.role = v1::ROLE_EDITOR;
    where.model = model;
    where.answer_when = v1::SAVE_LEVEL_APPLIED;
    auto target = RemoteTarget::connect(endpoint(), clock_, where);
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
    for (int i = 0; i < options_.fill;) {
      const auto done = target->submit(next_operation(static_cast<std::uint64_t>(i)));
      if (done) {
        ++i;
      } else if (done.error().code == ErrorCode::resource_exhausted) {
        std::this_thread::sleep_for(20ms);  // For the disk.
      } else {
        throw std::runtime_error(done.error().describe());
      }
    }
  }

  /// A point more, or a name as long as the one before.
  v1::Operation next_operation(std::uint64_t number) const {
    v1::Operation operation;
    if (options_.steady) {
      operation.mutable_rename()->set_entity("points");
      operation.mutable_rename()->set_name(fmt::format("points {:03}", number % 1000));
      return operation;
    }
    operation.mutable_add_points()->set_entity("points");
    v1::Point& point = *operation.mutable_add_points()->add_points();
    point.mutable_position()->set_x(1e-4 * static_cast<double>(number % 1000));
    point.set_pressure(0.5);
    return operation;
  }

  void show(Client& client, v1::TrackingFrame frame) {
    v1::Envelope envelope;
    frame.set_capture_time_ns(to_ns(clock_.now()));
    *envelope.mutable_tracking() = std::move(frame);
    client.send(envelope);
  }

  void take_hold() {
    std::this_thread::sleep_for(500ms);
    for (int i = 0; i < 20; ++i) {
      for (std::size_t model = 0; model < models(); ++model) {
        show(*clients_.at(model), i < 10 ? script_.resting(held_at + Vector3d(0, 0, 0.02))
                                         : script_.closed(held_at + Vector3d(0, 0, 0.02)));
      }
      std::this_thread::sleep_for(17ms);
    }
  }

  /// Everybody in turn, so that the load is even.
  void drive() {
    const auto begin = std::chrono::steady_clock::now();
    const auto turns = static_cast<std::uint64_t>(options_.seconds * options_.rate);
    const double turn_s = 1 / options_.rate;
    const double began_s = 1e-9 * static_cast<double>(to_ns(clock_.now()));
    for (std::uint64_t turn = 0; turn < turns; ++turn) {
      for (std::size_t i = 0; i < clients_.size(); ++i) {
        const double part = static_cast<double>(i) / static_cast<double>(clients_.size());
        std::this_thread::sleep_until(
            begin + std::chrono::duration_cast<std::chrono::nanoseconds>(
                        std::chrono::duration<double>((static_cast<double>(turn) + part) * turn_s)));
        if (drags(i)) {
          if (!options_.drags) continue;
          const double angle = 2 * std::numbers::pi * static_cast<double>(turns_ + turn) * turn_s;
          show(*clients_[i],
               script_.closed(held_at + Vector3d(0.02 * std::sin(angle), 0.01 * std::sin(2 * angle),
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
        if (!lays(i)) continue;
        const auto due =
            static_cast<std::uint64_t>(static_cast<double>(turn + 1) * turn_s * options_.operations_per_s);
        const auto done =
            static_cast<std::uint64_t>(static_cast<double>(turn) * turn_s * options_.operations_per_s);
        for (std::uint64_t each = done; each < due; ++each) submit_to(model_of(i));
      }
      const double now_s = 1e-9 * static_cast<double>(to_ns(clock_.now())) - began_s;
      if (turn % static_cast<std::uint64_t>(options_.rate) == 0) note_memory(now_s);
    }
    turns_ += turns;
  }

  /// Each second what is resident, and each tenth one what of it is held.
  void note_memory(double now_s) {
    resident_.emplace_back(now_s, rss_mib(server_->pid()));
    if (resident_.size() % 10 == 1) held_.emplace_back(now_s, heap_mib(metrics()));
  }

  void submit_to(std::size_t model) {
    v1::Envelope envelope;
    envelope.mutable_submit()->set_request(++last_request_);
    *envelope.mutable_submit()->mutable_operation() = next_operation(last_request_);
    sent_[model].push_back({to_ns(clock_.now()), last_request_});
    layer(model).send(envelope);
  }

  Figures read_figures() {
    Figures figures;
    const auto milliseconds = [](std::int64_t from_ns, std::int64_t to_ns) {
      return 1e-6 * static_cast<double>(to_ns - from_ns);
    };
    std::vector<std::map<std::uint64_t, Client::Seen>> acks(models());
    for (std::size_t model = 0; model < models(); ++model) {
      for (const Client::Seen& ack : layer(model).acks())
        acks[model][static_cast<std::uint64_t>(ack.capture_ns)] = ack;
      for (const Operation& operation : sent_[model]) {
        const auto ack = acks[model].find(operation.request);
        if (ack != acks[model].end()) figures.answers.add(milliseconds(operation.at_ns, ack->second.at_ns));
      }
    }
    // The same clients in every phase: those that never stall.
    const std::size_t never_watched =
        options_.rounds == 0 ? 0 : std::min<std::size_t>(most_stalled, clients_.size() - 3);
    for (std::size_t i = 0; i + never_watched < clients_.size(); ++i) {
      const auto seen = clients_[i]->take_seen();
      std::int64_t last = began_ns_;  // Deltas tell of the newest frame, which may be of the phase before.
      for (const Client::Seen& one : seen) {
        if (one.capture_ns <= last) continue;
        last = one.capture_ns;
        figures.frames.add(milliseconds(one.capture_ns, one.at_ns));
      }
      for (const Operation& operation : sent_[model_of(i)]) {
        const auto ack = acks[model_of(i)].find(operation.request);
        const auto first =
            ack == acks[model_of(i)].end()
                ? seen.end()
                : std::lower_bound(seen.begin(), seen.end(), ack->second.sequence,
                                   [](const auto& one, std::uint64_t value) { return one.sequence < value; });
        if (first == seen.end()) {
          ++figures.missed;
        } else {
          figures.operations.add(milliseconds(operation.at_ns, first->at_ns));
        }
      }
    }
    return figures;
  }

  const LoadOptions options_;
  test::TemporaryDirectory folder_;
  SystemClock clock_;
  std::unique_ptr<test::Process> server_;
  std::vector<std::unique_ptr<Client>> clients_;
  test::HandScript script_;
  std::vector<std::vector<Operation>> sent_;                ///< By model.
  std::vector<std::pair<double, double>> resident_, held_;  ///< Of the server: seconds, MiB.
  std::int64_t began_ns_ = 0;
  std::uint64_t turns_ = 0;
  std::uint64_t last_request_ = 0;
};

}  // namespace
}  // namespace handloft::session

int main(int count, char** words) {
  using namespace handloft::session;
  LoadOptions options;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    if (word == "--store" || word == "--steady" || word == "--no-drag") {
      options.store |= word == "--store";
      options.steady |= word == "--steady";
      options.drags &= word != "--no-drag";
      continue;
    }
    const double value = i + 1 < count ? std::atof(words[++i]) : 0;
    if (word == "--clients") {
      options.clients = static_cast<int>(value);
    } else if (word == "--seconds") {
      options.seconds = value;
    } else if (word == "--rate") {
      options.rate = value;
    } else if (word == "--surface") {
      options.control = static_cast<int>(value);
    } else if (word == "--models") {
      options.models = std::max(1, static_cast<int>(value));
    } else if (word == "--operations") {
      options.operations_per_s = value;
    } else if (word == "--fill") {
      options.fill = static_cast<int>(value);
    } else if (word == "--rounds") {
      options.rounds = static_cast<int>(value);
    } else {
      std::cerr
          << "found " << word
          << ", expected --clients, --models, --fill, --seconds, --rounds, --rate, --operations, --surface, "
             "--steady, --no-drag or --store\n";
      return 2;
    }
  }
  options.clients = std::max({4, options.clients, 2 * options.models});
  try {
    Load load(options);
    if (options.rounds > 0) {
      load.rounds();
    } else {
      load.phase();
    }
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
