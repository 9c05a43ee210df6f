#pragma once
// What must be true when all has settled.

#include <cstdint>
#include <string>

#include "tests/simulation/judge.h"
#include "tests/simulation/person.h"
#include "tests/simulation/simulated_access.h"
#include "tests/simulation/simulated_server.h"

namespace handloft::simulation {

/// C1: a client has what somebody would get who came now, to what the wire rounds.
void check_mirror(const Person& person, const stream::Scene& scene, Judge& judge);

struct LogFigures {
  std::uint64_t records = 0;
  std::string document_hash;  ///< Of what is served.
};
/// D1, H3: every operation that was acknowledged is in the log once, at its place, in its client's order;
/// nothing that was refused is. D6: the log, replayed, gives the document that is served.
/// U2: nothing is in it that somebody did who might not (`access` may be null).
LogFigures check_log(SimulatedServer& server, const std::string& model, const SimulatedAccess* access,
                     Judge& judge);

}  // namespace handloft::simulation
