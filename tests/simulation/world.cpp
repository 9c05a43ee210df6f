#include "tests/simulation/world.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "tests/simulation/final_checks.h"

namespace handloft::simulation {
namespace {

/// In which all must settle once nothing goes wrong any more: longer than anybody's patience, several times.
constexpr double settles_within_s = 120;
/// Nobody reads nothing for longer than this,
constexpr double longest_stall_s = 8;
/// and after this nothing is on the way any more.
constexpr double calm_s = longest_stall_s + 2;
/// Of a thread, for each client: what a peer may have under way, and what a mesh or a scene asks for.
constexpr std::size_t most_waiting_each = 200;

class World {
 public:
  World(std::uint64_t seed, const WorldOptions& options)
      : options_(options),
        timeline_(seed),
        judges_(options.models),
        access_(options.roles_change > 0 || options.devices_revoked > 0
                    ? std::make_unique<SimulatedAccess>(timeline_, options.people, options.change, judge())
                    : nullptr),
        server_(timeline_, with_gate(options.server, access_.get()), judge()) {
    for (std::size_t i = 0; i < options.people; ++i) {
      PersonOptions person = options.person;
      person.number = i;
      person.model = name_of(i % options.models);
      if (i % 4 == 3) person.role = v1::ROLE_VIEWER;
      people_.push_back(std::make_unique<Person>(
          timeline_, person,
          [this, i](const v1::Hello& hello, ClientEnd end) {
            return server_.connect(hello, std::move(end), peer_of(i));
          },
          judge_of(i)));
    }
  }

  WorldOutcome run() {
    for (std::size_t i = 0; options_.devices_revoked > 0 && i < people_.size(); ++i) access_->pair(i);
    server_.start();
    for (const auto& person : people_) {
      timeline_.after(timeline_.random().unit() * options_.all_there_after_s, [&] { person->begin(); });
    }
    now_and_then(options_.connections_cut, [this] { cut(); });
    now_and_then(options_.people_crash, [this] { somebody().crash(); });
    now_and_then(options_.stalls, [this] { somebody().stall(random().between(0, longest_stall_s)); });
    now_and_then(options_.waves, [this] { somebody().wave(static_cast<int>(1 + random().below(100))); });
    now_and_then(options_.server_dies, [this] { kill(); });
    now_and_then(options_.server_stops, [this] {
      server_.stop();
      restart_soon();
    });
    now_and_then(options_.disk_breaks, [this] { break_disk(); });
    if (access_) now_and_then(options_.roles_change, [this] { change_role(); });
    if (access_) now_and_then(options_.devices_revoked, [this] { revoke_device(); });
    run_for(options_.lasts_s, [] { return false; });
    quiet_ = true;
    server_.let_live();
    for (std::size_t i = 0; access_ && i < people_.size(); ++i) access_->grant(i, v1::ROLE_OWNER);
    for (std::size_t i = 0; options_.devices_revoked > 0 && i < people_.size(); ++i) access_->pair(i);
    for (const auto& person : people_) person->works(false);
    settle();
    return outcome();
  }

 private:
  static SimulatedServerOptions with_gate(SimulatedServerOptions server, const SimulatedAccess* access) {
    if (access != nullptr) server.gate = access->gate();
    return server;
  }
  static std::string name_of(std::size_t model) {
    return model == 0 ? std::string() : "model-" + std::to_string(model);
  }
  /// Of the first model, and of what concerns none.
  Judge& judge() { return judges_.front(); }
  Judge& judge_of(std::size_t person) {
    const std::size_t off = options_.dealt == WorldOptions::Dealt::otherwise ? 1 : 0;
    return judges_[(person + off) % judges_.size()];
  }
  bool has_complaints() const {
    return std::any_of(judges_.begin(), judges_.end(),
                       [](const Judge& judge) { return !judge.complaints().empty(); });
  }
  Random& random() { return timeline_.random(); }
  Person& somebody() { return *people_.at(random().below(people_.size())); }

  void now_and_then(double per_s, const std::function<void()>& what) {
    if (per_s <= 0) return;
    timeline_.after(random().between(0, 2 / per_s), [this, per_s, what] {
      if (quiet_) return;
      what();
      now_and_then(per_s, what);
    });
  }

  void cut() {
    Person& person = somebody();
    if (!person.link()) return;
    switch (random().below(3)) {
      case 0:  // Both hear of it soon.
        person.link()->cut(random().unit(), random().unit());
        break;
      case 1:  // Half-open: the server believes in it for long, the client may be back meanwhile,
        person.link()->cut(random().between(5, 30), random().unit());
        break;
      default:  // or the client does.
        person.link()->cut(random().unit(), random().between(5, 60));
        break;
    }
  }

  void change_role() {
    constexpr v1::Role roles[] = {v1::ROLE_UNSPECIFIED, v1::ROLE_VIEWER, v1::ROLE_COMMENTER,
                                  v1::ROLE_EDITOR,      v1::ROLE_OWNER,  v1::ROLE_OWNER};
    access_->grant(random().below(people_.size()), roles[random().below(std::size(roles))]);
  }

  SimulatedPeer peer_of(std::size_t person) const {
    SimulatedPeer peer;
    if (!access_) return peer;
    peer.uid = SimulatedAccess::uid_of(person);
    peer.certificate = access_->certificate_of(person);
    return peer;
  }

  void revoke_device() {
    const std::size_t person = random().below(people_.size());
    access_->revoke_device(person);
    if (const LinkPtr link = people_[person]->link()) {
      timeline_.after(SimulatedAccess::seen_within_s, [this, link, person] {
        if (link->served())
          judge().complain("U2: the connection of person " + std::to_string(person) + " outlives its device");
      });
    }
    timeline_.after(random().between(2, 5), [this, person] {
      if (!quiet_) access_->pair(person);
    });
  }

  void kill() {
    const auto crash = static_cast<test::Crash>(random().below(3));
    if (random().chance(0.5)) {
      server_.kill_in_commit(crash);  // If one comes.
    } else {
      server_.kill(crash);
    }
    restart_soon();
  }

  void restart_soon() {
    timeline_.after(random().between(0.1, 3), [this] {
      if (server_.up()) {
        // The commit that it was to die in has not come yet.
        if (!quiet_) restart_soon();
        return;
      }
      server_.start();
    });
  }

  void break_disk() {
    using test::FaultDisk;
    constexpr FaultDisk::Failure kinds[] = {
        FaultDisk::Failure::error, FaultDisk::Failure::torn_error, FaultDisk::Failure::full_for_good,
        FaultDisk::Failure::error_for_good, FaultDisk::Failure::read_error};
    server_.break_disk(kinds[random().below(std::size(kinds))]);
    // Somebody sees to it, and begins anew.
    timeline_.after(random().between(1, 3), [this] {
      server_.kill(test::Crash::process_dies);
      restart_soon();
    });
  }

  template <typename Done>
  bool run_for(double seconds, const Done& done) {
    const TimePoint end = timeline_.now() + from_seconds(seconds);
    while (!done()) {
      if (has_complaints() || !timeline_.step(end)) return false;
    }
    return true;
  }

  void settle() {
    const auto settled = [this] {
      if (!server_.up()) {
        restart_soon_once();
        return false;
      }
      if (!server_.idle()) return false;
      for (const auto& person : people_) {
        const session::RoomPtr room = server_.room(person->options().model);
        if (!room) return false;
        const auto scene = room->actor->scene();
        const auto seen = person->mirror().scene();
        if (!person->content() || seen->epoch != scene->epoch || seen->sequence != scene->sequence)
          return false;
      }
      return true;
    };
    const TimePoint end = timeline_.now() + from_seconds(settles_within_s);
    // A fault that was under way may still come, and what is on the way arrives: meshes, presence.
    do {
      if (run_for(to_seconds(end - timeline_.now()), settled)) {
        run_for(calm_s, [] { return false; });
      } else if (!has_complaints()) {
        judge().complain(server_.up() ? "somebody waits for ever" : "the server does not come back");
        for (const auto& person : people_) {
          if (!person->content()) judge().complain(person->words());
        }
      }
    } while (!has_complaints() && !settled());
  }

  void restart_soon_once() {
    if (std::exchange(restarting_, true)) return;
    timeline_.after(1, [this] {
      server_.start();
      restarting_ = false;
    });
  }

  WorldOutcome outcome() {
    WorldOutcome outcome;
    if (!has_complaints() && server_.up()) {
      for (const auto& person : people_) {
        if (const session::RoomPtr room = server_.room(person->options().model))
          check_mirror(*person, *room->actor->scene(), judge());
      }
      for (std::size_t i = 0; i < judges_.size() && i < people_.size(); ++i) {
        const LogFigures log = check_log(server_, name_of(i), access_.get(), judges_[i]);
        outcome.in_log += log.records;
        outcome.document_hash += log.document_hash;
      }
    }
    outcome.simulated_s = timeline_.seconds();
    outcome.restarts = server_.starts() - 1;
    for (const auto& person : people_) {
      const PersonStatistics& its = person->statistics();
      outcome.operations += its.operations;
      outcome.sent_again += its.sent_again;
      outcome.joins += its.joins;
      outcome.resumed += its.resumed;
      outcome.gave_up += its.gave_up;
      outcome.begun_anew += its.begun_anew;
      outcome.sent_away += its.sent_away;
      outcome.denied += its.denied;
      if (options_.devices_revoked > 0 && its.denied > 0 && !access_->was_revoked(person->options().number))
        judge().complain("U2: " + person->words() + " was sent away, though nobody has revoked its device");
      outcome.longest_join_s = std::max(outcome.longest_join_s, its.longest_join_s);
      outcome.trace = (outcome.trace * 31) ^ person->trace();
    }
    for (const Judge& each : judges_) {
      for (const auto& [op, told] : each.told()) {
        if (told.promise == Judge::Promise::durable) ++outcome.durable;
        if (told.promise == Judge::Promise::refused) ++outcome.refused;
      }
    }
    if (access_) outcome.roles_changed = access_->changes();
    server_.take_figures();
    outcome.most_waiting = server_.most_waiting();
    outcome.most_queued_bytes = server_.most_queued_bytes();
    if (outcome.most_waiting > most_waiting_each * options_.people)
      judge().complain(std::to_string(outcome.most_waiting) + " pieces of work waited");
    const net::OutboxLimits& limits = options_.server.link.outbox;
    if (outcome.most_queued_bytes > limits.max_queued_bytes + limits.max_slot_bytes)
      judge().complain(std::to_string(outcome.most_queued_bytes) + " bytes waited for a client");
    for (const Judge& each : judges_)
      outcome.complaints.insert(outcome.complaints.end(), each.complaints().begin(), each.complaints().end());
    return outcome;
  }

  const WorldOptions options_;
  Timeline timeline_;
  std::vector<Judge> judges_;  ///< By model.
  std::unique_ptr<SimulatedAccess> access_;
  SimulatedServer server_;
  std::vector<std::unique_ptr<Person>> people_;
  bool quiet_ = false;
  bool restarting_ = false;
};

}  // namespace

WorldOutcome run_world(std::uint64_t seed, const WorldOptions& options) {
  return World(seed, options).run();
}

WorldOptions random_options(std::uint64_t seed) {
  Random random(seed ^ 0x5eedU);
  WorldOptions options;
  options.people = 2 + random.below(7);
  options.lasts_s = random.between(4, 16);
  // Few faults in some worlds and many in others, so that each kind also comes alone.
  for (double* often : {&options.connections_cut, &options.people_crash, &options.stalls, &options.waves,
                        &options.server_dies, &options.server_stops, &options.disk_breaks}) {
    *often *= random.chance(0.3) ? 0.0 : random.between(0.2, 3);
  }
  options.server.snapshot_every = 5 + random.below(100);
  options.server.checkpoint_pages = static_cast<int>(4 + random.below(60));
  options.server.disk_s = random.between(0.001, 0.2);
  options.server.link.longest_delay_s = random.between(0, 0.3);
  options.server.link.kernel_bytes = std::size_t{1} << (10 + random.below(8));
  if (random.chance(0.3)) {
    options.server.link.outbox.max_queued_bytes = 4096;
    options.server.link.outbox.max_queued_frames = 16;
  }
  // Lanes that fill: of those who read slowly the presence of some is dropped, and scenes begin anew.
  if (random.chance(0.5)) {
    options.server.scene_bytes = 100 + random.below(2000);
    options.server.link.outbox.max_slots = 1 + random.below(4);
    options.server.link.outbox.max_slot_bytes = 64 + random.below(1024);
    options.server.link.kernel_bytes = std::size_t{1} << (8 + random.below(6));
  }
  options.models = random.chance(0.4) ? 2 + random.below(2) : 1;
  options.models = std::min(options.models, options.people);
  // With a real file, and so by real time the slowest of all: in some.
  options.roles_change = random.chance(0.15) ? random.between(0.2, 1.5) : 0.0;
  options.person.mean_pause_s = random.between(0.05, 0.5);
  options.person.most_unanswered = 1 + random.below(16);
  options.person.mix.undo = random.between(0, 0.3);
  if (options.roles_change == 0 && random.chance(0.1)) options.devices_revoked = random.between(0.2, 1.5);
  return options;
}

}  // namespace handloft::simulation
