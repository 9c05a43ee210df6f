// The real program among hostile servers (V5, F1, F2): through every attack in one session it lives, holds a
// bounded amount of memory, and in the end shows the good scene that was sent last.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>

#include "client-hmd/render/image.h"
#include "tests/integration/client-hmd/hostile_attacks.h"
#include "tests/support/build_kind.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::client {
namespace {

using handloft::test::HostileConnection;
using handloft::test::HostileServer;
using std::chrono::seconds;
using test::Attack;
using test::Outcome;

std::string peak_memory_kib(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return line.substr(6);
  }
  return "0";
}

std::vector<std::string> viewer(const net::Endpoint& model, const std::filesystem::path& folder,
                                const std::string& name) {
  return {handloft::test::program("handloft-hmd"),
          "--model",
          model.to_string(),
          "--offscreen",
          "--size",
          "320x240",
          "--frame-rate",
          "30",
          "--screenshot",
          folder / (name + ".png"),
          "--report",
          folder / (name + ".json"),
          "--log-level",
          "warning"};
}

TEST(HostileServers, TheProgramLivesThroughAllAttacksAndShowsTheLastGoodScene_V5) {
  const handloft::test::TemporaryDirectory folder;
  const net::Endpoint endpoint = *net::parse_endpoint("unix:" + (folder.path() / "s.sock").string());
  // What the good scene looks like.
  {
    HostileServer good(endpoint, [](HostileConnection& client) {
      if (test::serve_good_scene(client)) client.hold();
    });
    std::vector<std::string> words = viewer(endpoint, folder.path(), "good");
    words.push_back("--once");
    handloft::test::Process hmd(words, folder.path() / "good.log");
    ASSERT_EQ(hmd.wait(seconds(60)), 0) << hmd.error_output();
  }
  std::promise<void> done;
  std::atomic<std::size_t> next{0}, greeting{0};
  std::atomic<int> wrong{0};
  std::string wrong_name;
  const auto serve = [&](HostileConnection& client) {
    if (greeting < test::bad_greetings().size()) {
      (void)client.receive_until([](const v1::Envelope& e) { return e.has_hello(); });
      test::bad_greetings()[greeting++].run(client);
      return;
    }
    if (!test::serve_good_scene(client)) return;
    while (next < test::attacks().size()) {
      const Attack& attack = test::attacks()[next++];
      const bool survived = attack.run(client) && client.survives();
      if (survived != (attack.outcome != Outcome::hangs_up)) {
        ++wrong;
        wrong_name = attack.name;
      }
      if (!survived) return;
      if (!test::send_good_scene(client) || !client.survives()) return;
    }
    done.set_value();
    client.hold();
  };
  std::string peak;
  std::string log;
  {
    HostileServer server(endpoint, serve);
    handloft::test::Process hmd(viewer(endpoint, folder.path(), "attacked"), folder.path() / "hmd.log");
    ASSERT_EQ(done.get_future().wait_for(seconds(200)), std::future_status::ready)
        << "at attack " << next << "\n"
        << hmd.error_output();
    peak = peak_memory_kib(hmd.pid());
    hmd.signal(SIGTERM);
    ASSERT_EQ(hmd.wait(seconds(60)), 0) << hmd.error_output();
    log = hmd.error_output();
  }
  EXPECT_EQ(wrong, 0) << wrong_name;
  std::ifstream in(folder.path() / "attacked.json");
  const nlohmann::json report = nlohmann::json::parse(in, nullptr, false);
  ASSERT_FALSE(report.is_discarded());
  const auto of = [](Outcome outcome) {
    return std::count_if(test::attacks().begin(), test::attacks().end(),
                         [outcome](const Attack& attack) { return attack.outcome == outcome; });
  };
  EXPECT_GE(report["messages_refused"].get<int>(), of(Outcome::refused)) << report;
  EXPECT_EQ(report["reconnects"].get<int>(), of(Outcome::hangs_up)) << report;
  EXPECT_EQ(report["scene"]["points"].get<std::size_t>(), test::good_points);
  const Result<Image> good = read_png(folder.path() / "good.png");
  const Result<Image> attacked = read_png(folder.path() / "attacked.png");
  ASSERT_TRUE(good.ok() && attacked.ok());
  EXPECT_GT(*structural_similarity(*good, *attacked), 0.98) << "the last good scene is shown";
  EXPECT_EQ(log.find('\x1B'), std::string::npos) << "nothing of a stranger's moves the terminal's cursor";
  EXPECT_LT(log.size(), 100'000U) << "nor fills the log";
  const double peak_mib = std::stod(peak) / 1024.0;
  std::printf(
      "%zu attacks and %zu bad greetings: %s refused, %s reconnects, peak memory %.0f MiB, log %zu bytes\n",
      test::attacks().size(), test::bad_greetings().size(), report["messages_refused"].dump().c_str(),
      report["reconnects"].dump().c_str(), peak_mib, log.size());
  if (!handloft::test::sanitized) {
    EXPECT_LT(peak_mib, 1500.0);
  }
}

}  // namespace
}  // namespace handloft::client
