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
      : options_(options), timeline_(seed), server_(timeline_, options.server, judge_) {
    for (std::size_t i = 0; i < options.people; ++i) {
      PersonOptions person = options.person;
      person.number = i;
      if (i % 4 == 3) person.role = v1::ROLE_VIEWER;
      people_.push_back(std::make_unique<Person>(
          timeline_, person,
          [this](const v1::Hello& hello, ClientEnd end) { return server_.connect(hello, std::move(end)); },
          judge_));
    }
  }

  WorldOutcome run() {
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
    run_for(options_.lasts_s, [] { return false; });
    quiet_ = true;
    server_.let_live();
    for (const auto& person : people_) person->works(false);
    settle();
    return outcome();
  }

 private:
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
      if (!judge_.complaints().empty() || !timeline_.step(end)) return false;
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
      const auto scene = server_.peers().actor().scene();
      for (const auto& person : people_) {
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
      } else if (judge_.complaints().empty()) {
        judge_.complain(server_.up() ? "somebody waits for ever" : "the server does not come back");
        for (const auto& person : people_) {
          if (!person->content()) judge_.complain(person->words());
        }
      }
    } while (judge_.complaints().empty() && !settled());
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
    if (judge_.complaints().empty() && server_.up()) {
      const auto scene = server_.peers().actor().scene();
      for (const auto& person : people_) check_mirror(*person, *scene, judge_);
      const LogFigures log = check_log(server_, judge_);
      outcome.in_log = log.records;
      outcome.document_hash = log.document_hash;
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
      outcome.longest_join_s = std::max(outcome.longest_join_s, its.longest_join_s);
      outcome.trace = (outcome.trace * 31) ^ person->trace();
    }
    for (const auto& [op, told] : judge_.told()) {
      if (told.promise == Judge::Promise::durable) ++outcome.durable;
      if (told.promise == Judge::Promise::refused) ++outcome.refused;
    }
    server_.take_figures();
    outcome.most_waiting = server_.most_waiting();
    outcome.most_queued_bytes = server_.most_queued_bytes();
    if (outcome.most_waiting > most_waiting_each * options_.people)
      judge_.complain(std::to_string(outcome.most_waiting) + " pieces of work waited");
    const net::OutboxLimits& limits = options_.server.link.outbox;
    if (outcome.most_queued_bytes > limits.max_queued_bytes + limits.max_slot_bytes)
      judge_.complain(std::to_string(outcome.most_queued_bytes) + " bytes waited for a client");
    outcome.complaints = judge_.complaints();
    return outcome;
  }

  const WorldOptions options_;
  Judge judge_;
  Timeline timeline_;
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
  options.person.mean_pause_s = random.between(0.05, 0.5);
  options.person.most_unanswered = 1 + random.below(16);
  options.person.mix.undo = random.between(0, 0.3);
  return options;
}

}  // namespace handloft::simulation
