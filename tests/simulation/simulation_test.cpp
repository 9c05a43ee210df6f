// S1: a deterministic simulation of server and clients (Zhou et al. 2021, "FoundationDB", section 4): the
// real session code, store and mirrors under a virtual clock, a network and a disk that do their worst. One
// seed is one run. Here 500 seeds; more: HANDLOFT_SEEDS=20000 build/release/bin/integration_simulation
// --gtest_filter=Simulation.S1*; one again: HANDLOFT_SEED=17 in its place.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <iostream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/simulation/world.h"
#include "tests/support/build_kind.h"

namespace handloft::simulation {
namespace {

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::strtoull(value, nullptr, 10);
}

std::string all_words(const WorldOutcome& outcome) {
  std::string words;
  for (const std::string& complaint : outcome.complaints) words += complaint + "\n";
  return words;
}

TEST(Simulation, S1WhateverGoesWrongNothingPromisedIsBroken) {
  const char* one = std::getenv("HANDLOFT_SEED");
  const std::uint64_t first = from_environment("HANDLOFT_SEED", from_environment("HANDLOFT_FIRST_SEED", 1));
  const std::uint64_t seeds =
      one != nullptr ? 1 : from_environment("HANDLOFT_SEEDS", test::sanitized ? 60 : 500);
  WorldOutcome all;
  std::uint64_t failed = 0;
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    const WorldOutcome outcome = run_world(seed, random_options(seed));
    all.simulated_s += outcome.simulated_s;
    all.operations += outcome.operations;
    all.in_log += outcome.in_log;
    all.durable += outcome.durable;
    all.refused += outcome.refused;
    all.sent_again += outcome.sent_again;
    all.joins += outcome.joins;
    all.resumed += outcome.resumed;
    all.gave_up += outcome.gave_up;
    all.restarts += outcome.restarts;
    all.begun_anew += outcome.begun_anew;
    all.sent_away += outcome.sent_away;
    all.roles_changed += outcome.roles_changed;
    all.most_waiting = std::max(all.most_waiting, outcome.most_waiting);
    all.most_queued_bytes = std::max(all.most_queued_bytes, outcome.most_queued_bytes);
    if (outcome.complaints.empty()) continue;
    ADD_FAILURE() << "seed " << seed << ":\n"
                  << all_words(outcome) << "again: HANDLOFT_SEED=" << seed
                  << " build/release/bin/integration_simulation --gtest_filter=Simulation.S1*";
    if (++failed == 10) break;
  }
  std::cout << seeds << " seeds, " << all.simulated_s << " s simulated: " << all.operations
            << " operations, of which " << all.durable << " acknowledged and " << all.refused << " refused, "
            << all.sent_again << " sent again, " << all.joins << " joins (" << all.resumed << " resumed), "
            << all.gave_up << " connections given up, " << all.begun_anew
            << " snapshots since somebody read too slowly, " << all.sent_away << " sent away, "
            << all.roles_changed << " roles changed, " << all.restarts << " restarts; at most "
            << all.most_waiting << " pieces of work and " << all.most_queued_bytes << " bytes waited\n";
  if (one != nullptr) return;
  // A simulation in which nothing goes wrong shows nothing.
  EXPECT_GT(all.durable, 20 * seeds);
  EXPECT_GT(all.refused, seeds / 2);
  EXPECT_GT(all.sent_again, seeds / 2);
  EXPECT_GT(all.restarts, seeds / 2);
  EXPECT_GT(all.begun_anew, seeds / 10);
  EXPECT_GT(all.sent_away, seeds / 10);
  EXPECT_GT(all.roles_changed, seeds / 10);
}

TEST(Simulation, ASeedIsARun) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const WorldOutcome once = run_world(seed, random_options(seed));
    const WorldOutcome again = run_world(seed, random_options(seed));
    EXPECT_EQ(once.trace, again.trace) << seed;
    EXPECT_EQ(once.in_log, again.in_log) << seed;
  }
  EXPECT_NE(run_world(1).trace, run_world(2).trace);
}

/// How many of the seeds are caught, with such words.
std::uint64_t caught(std::uint64_t seeds, const WorldOptions& options, const std::string& words) {
  std::uint64_t count = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const std::string complaints = all_words(run_world(seed, options));
    if (!complaints.empty() && complaints.find(words) != std::string::npos) ++count;
  }
  return count;
}

/// Of somebody who misses what the others saw, however that shows.
std::uint64_t caught_missing(std::uint64_t seeds, const WorldOptions& options) {
  return caught(seeds, options, "C1") + caught(seeds, options, "cannot read a delta") +
         caught(seeds, options, "waits for ever");
}

TEST(Simulation, NegativeControlAnAnswerBeforeTheDiskHasItIsCaught) {
  WorldOptions options;
  options.person.hurries = 0;
  options.server.acknowledge = session::ActorOptions::Acknowledge::applied;
  EXPECT_GE(caught(10, options, "answered before the disk has it"), 5U);
}

TEST(Simulation, NegativeControlADiskThatForgetsWhatItFlushedIsCaught) {
  WorldOptions options;
  options.server_dies = 0.5;
  options.server.disk_s = 0.05;
  EXPECT_EQ(caught(10, options, ""), 0U);
  options.server.disk = SimulatedServerOptions::Disk::lies;
  EXPECT_GE(caught(10, options, "D1"), 3U);
}

TEST(Simulation, NegativeControlALostDeltaIsCaught) {
  WorldOptions options;
  options.server.link.vanishing_per_million = 20'000;
  EXPECT_GE(caught_missing(10, options), 5U);
}

TEST(Simulation, NegativeControlARetryOfSomebodyElseIsCaught) {
  WorldOptions options;
  options.connections_cut = 3;
  options.person.key = PersonOptions::Key::forgotten;
  EXPECT_GE(caught(10, options, "H3"), 5U);
}

/// Worlds in which little is kept for those who read slowly.
WorldOptions slow_readers() {
  WorldOptions options;
  options.server_dies = options.server_stops = options.disk_breaks = 0;
  options.stalls = 2;
  options.server.scene_bytes = 200;
  options.server.link.kernel_bytes = 512;
  return options;
}

TEST(Simulation, U4WhoReadsTooSlowlyBeginsAnewAndSeesAll) {
  std::uint64_t begun_anew = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const WorldOutcome outcome = run_world(seed, slow_readers());
    EXPECT_TRUE(outcome.complaints.empty()) << seed << ": " << all_words(outcome);
    begun_anew += outcome.begun_anew;
  }
  EXPECT_GT(begun_anew, 10U);
}

TEST(Simulation, NegativeControlWhoPassesOverTheSnapshotThatBeginsAnewIsCaught) {
  WorldOptions options = slow_readers();
  options.person.anew = PersonOptions::Anew::passed_over;
  EXPECT_GE(caught_missing(10, options), 3U);
}

TEST(Simulation, U2WhoseRoleIsTakenDoesNothingFromThenOn) {
  WorldOptions options;
  options.roles_change = 2;
  EXPECT_EQ(caught(10, options, ""), 0U);
  options.change = SimulatedAccess::Change::forgotten;  // Negative control.
  EXPECT_GE(caught(10, options, "U2"), 5U);
}

TEST(Simulation, U2ARevokedDeviceIsGoneAndDoesNothingFromThenOnAndNobodyElseNotices) {
  WorldOptions options;
  options.devices_revoked = 1;
  std::uint64_t denied = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const WorldOutcome outcome = run_world(seed, options);
    EXPECT_TRUE(outcome.complaints.empty()) << seed << ": " << all_words(outcome);
    denied += outcome.denied;
  }
  EXPECT_GT(denied, 10U) << "some have worked just then";
  // Negative controls.
  options.change = SimulatedAccess::Change::forgotten;
  EXPECT_GE(caught(10, options, "outlives its device"), 5U);
  options.change = SimulatedAccess::Change::another;
  EXPECT_GE(caught(10, options, "outlives its device") + caught(10, options, "nobody has revoked"), 5U);
}

TEST(Simulation, U1WhatIsDoneToOneModelIsInNoOther) {
  WorldOptions options;
  options.models = 3;
  options.people = 6;
  EXPECT_EQ(caught(10, options, ""), 0U);
  options.dealt = WorldOptions::Dealt::otherwise;  // Negative control.
  EXPECT_GE(caught(10, options, "is nobody's") + caught(10, options, "D1"), 8U);
}

}  // namespace
}  // namespace handloft::simulation
