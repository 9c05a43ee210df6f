#pragma once
// One run of the simulation: a server, people, and everything that goes wrong, all decided by one seed. At
// the end the faults end, all settles, and what is there is held against what was promised (S1, D1, D6, H3,
// C1).

#include <cstdint>
#include <string>
#include <vector>

#include "tests/simulation/person.h"
#include "tests/simulation/simulated_access.h"
#include "tests/simulation/simulated_server.h"

namespace handloft::simulation {

struct WorldOptions {
  std::size_t people = 5;
  double lasts_s = 12;
  /// How often a second, for all together.
  double connections_cut = 0.4;
  double people_crash = 0.1;
  double stalls = 0.2;
  double waves = 0.5;
  double server_dies = 0.12;
  double server_stops = 0.03;
  double disk_breaks = 0.03;
  double roles_change = 0;  ///< Then there is an access file, and people are anybody from viewers to owners.
  /// Then people come by TLS, each with a device of an access file, which is revoked while they work; some
  /// time later they are given another one.
  double devices_revoked = 0;
  SimulatedAccess::Change change = SimulatedAccess::Change::written;
  std::size_t models = 1;  ///< Of one server; the people are dealt out to them.
  enum class Dealt {
    as_they_join,
    otherwise,  ///< Negative control: what they did is looked for in another one.
  };
  Dealt dealt = Dealt::as_they_join;
  /// People come one after another within the first so many seconds.
  double all_there_after_s = 4;
  SimulatedServerOptions server;
  PersonOptions person;
};

struct WorldOutcome {
  std::vector<std::string> complaints;  ///< Empty: all is as it must be.
  std::uint64_t trace = 0;              ///< Of all that all were told: equal for equal seeds.
  double simulated_s = 0;
  std::uint64_t operations = 0, in_log = 0, durable = 0, refused = 0;
  std::uint64_t sent_again = 0, joins = 0, resumed = 0, gave_up = 0, restarts = 0;
  std::uint64_t begun_anew = 0, sent_away = 0, denied = 0, roles_changed = 0, dropped = 0;
  std::size_t most_waiting = 0, most_queued_bytes = 0;
  double longest_join_s = 0;  ///< From a connection to the scene on it, of those that lived to see it.
  std::string document_hash;  ///< In the end.
};

WorldOutcome run_world(std::uint64_t seed, const WorldOptions& options = {});

/// As many faults as the seed likes.
WorldOptions random_options(std::uint64_t seed);

}  // namespace handloft::simulation
