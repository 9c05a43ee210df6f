// C1: eight people do random things at once, undo among them; in the end all see what the server serves. C3:
// people come late and lose their connections at random moments under load, and go on. D6: the log of each
// run, replayed from its start, gives the same document. Over the simulated network: no real time passes.
// More: HANDLOFT_RUNS=20000.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "tests/simulation/world.h"
#include "tests/support/build_kind.h"

namespace handloft::simulation {
namespace {

std::uint64_t runs(std::uint64_t usually) {
  const char* wanted = std::getenv("HANDLOFT_RUNS");
  if (wanted != nullptr) return std::strtoull(wanted, nullptr, 10);
  return test::sanitized ? usually / 8 : usually;
}

/// Nothing goes wrong.
WorldOptions calm() {
  WorldOptions options;
  options.connections_cut = options.people_crash = options.stalls = 0;
  options.server_dies = options.server_stops = options.disk_breaks = 0;
  return options;
}

std::string all_words(const WorldOutcome& outcome) {
  std::string words;
  for (const std::string& complaint : outcome.complaints) words += complaint + "\n";
  return words;
}

TEST(Convergence, C1EightPeopleAtOnceSeeTheSameInTheEnd) {
  WorldOptions options = calm();
  options.people = 8;
  options.lasts_s = 6;
  options.all_there_after_s = 1;
  options.person.mean_pause_s = 0.25;
  options.person.mix.undo = 0.3;
  const std::uint64_t count = runs(200);
  std::uint64_t operations = 0, durable = 0;
  for (std::uint64_t run = 1; run <= count && !HasFailure(); ++run) {
    options.server.link.longest_delay_s = run % 2 == 0 ? 0.02 : 0.3;
    const WorldOutcome outcome = run_world(run, options);
    EXPECT_TRUE(outcome.complaints.empty()) << "run " << run << ":\n" << all_words(outcome);
    operations += outcome.operations;
    durable += outcome.durable;
  }
  std::cout << count << " runs of 8 people: " << operations << " operations, " << durable
            << " of them in the log\n";
  EXPECT_GT(durable, count * 40);
}

TEST(Convergence, C3WhoComesLateOrAgainUnderLoadSeesAll) {
  WorldOptions options = calm();
  options.people = 6;
  options.lasts_s = 20;
  options.all_there_after_s = 18;
  options.connections_cut = 1.5;
  options.stalls = 0.3;
  options.server.link.longest_delay_s = 0.05;
  const std::uint64_t count = runs(100);
  std::uint64_t joins = 0, resumed = 0;
  double longest = 0;
  for (std::uint64_t run = 1; run <= count && !HasFailure(); ++run) {
    const WorldOutcome outcome = run_world(1000 + run, options);
    EXPECT_TRUE(outcome.complaints.empty()) << "run " << run << ":\n" << all_words(outcome);
    joins += outcome.joins;
    resumed += outcome.resumed;
    longest = std::max(longest, outcome.longest_join_s);
  }
  std::cout << count << " runs: " << joins << " joins, " << resumed << " of them resumed, the longest took "
            << longest << " s of simulated time\n";
  EXPECT_GT(joins, 10 * count);
}

// Two builds do the same: HANDLOFT_HASHES=file writes the hashes where the file is not there, and compares
// with it where it is: once with build/release, once with build/asan. HANDLOFT_LONG=1: 1,000 sessions.
TEST(Convergence, D6SessionsGiveTheSameDocumentsInEveryBuild) {
  const std::uint64_t sessions = std::getenv("HANDLOFT_LONG") != nullptr ? 1'000 : 50;
  const char* path = std::getenv("HANDLOFT_HASHES");
  std::vector<std::string> expected;
  if (path != nullptr) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) expected.push_back(line);
  }
  const std::uint64_t count = path == nullptr && test::sanitized ? 10 : sessions;
  std::vector<std::string> hashes;
  for (std::uint64_t seed = 1; seed <= count; ++seed) {
    const WorldOutcome outcome = run_world(5000 + seed, calm());
    EXPECT_TRUE(outcome.complaints.empty()) << "session " << seed << ":\n" << all_words(outcome);
    hashes.push_back(outcome.document_hash);
  }
  if (path == nullptr) return;
  if (expected.empty()) {
    std::ofstream file(path);
    for (const std::string& hash : hashes) file << hash << '\n';
    return;
  }
  EXPECT_EQ(hashes, expected);
}

}  // namespace
}  // namespace handloft::simulation
