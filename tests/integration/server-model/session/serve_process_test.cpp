// `handloft-modeld serve` as its users start it: one line when ready, a graceful end, a report.

#include <gmock/gmock.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server-model/session/remote_target.h"
#include "tests/integration/server-model/session/session_peers.h"
#include "tests/support/process.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;

class ServeProcessTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("handloft-serve-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string in_folder(const std::string& name) const { return (folder_ / name).string(); }
  /// What an owner gets who does that in `model` of a server that serves the folder "models" meanwhile.
  Result<RemoteTarget::Outcome> outcome_in(const std::string& model, const v1::Operation& operation) {
    const std::string socket = "unix:" + in_folder("model.sock");
    test::Process server({HANDLOFT_MODELD, "serve", "--listen", socket, "--models", in_folder("models")},
                         in_folder("log"));
    EXPECT_TRUE(server.read_line(patience)) << server.error_output();
    RemoteTargetOptions where;
    where.role = v1::ROLE_OWNER;
    where.model = model;
    auto target = RemoteTarget::connect(*net::parse_endpoint(socket), clock_, where);
    auto outcome = target ? target->submit(operation) : Result<RemoteTarget::Outcome>(target.error());
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(patience), 0) << server.error_output();
    return outcome;
  }

  std::filesystem::path folder_;
  SystemClock clock_;
};

TEST_F(ServeProcessTest, is_ready_serves_stops_on_sigterm_and_reports) {
  std::ofstream(in_folder("setup.jsonl")) << R"({"create_dual_shape":{"id":"top"}})"
                                          << "\n";
  test::Process server(
      {HANDLOFT_MODELD, "serve", "--listen", "unix:" + in_folder("model.sock"), "--listen", "tcp:127.0.0.1:0",
       "--script", in_folder("setup.jsonl"), "--report", in_folder("report.json")},
      in_folder("log"));
  const auto line = server.read_line(patience);
  ASSERT_TRUE(line) << server.error_output();
  const auto ready = nlohmann::json::parse(*line);
  EXPECT_EQ(ready["ready"], true);
  ASSERT_EQ(ready["endpoints"].size(), 2U);
  for (const auto& text : ready["endpoints"]) {
    const auto endpoint = net::parse_endpoint(text.get<std::string>());
    ASSERT_TRUE(endpoint.ok());
    auto target = RemoteTarget::connect(*endpoint, clock_);
    ASSERT_TRUE(target.ok()) << target.error().describe();
    v1::Operation operation;
    operation.mutable_rename()->set_entity("top");
    operation.mutable_rename()->set_name("Top by " + text.get<std::string>().substr(0, 3));
    EXPECT_TRUE(target->submit(operation).ok());
  }
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(patience), 0) << server.error_output();
  EXPECT_EQ(server.read_all(1s), "") << "standard output is for the one line";
  EXPECT_FALSE(std::filesystem::exists(in_folder("model.sock")));
  const auto report = nlohmann::json::parse(std::ifstream(in_folder("report.json")));
  EXPECT_EQ(report["hash"].get<std::string>().size(), 64U);
  EXPECT_EQ(report["sequence"], 3) << "the script's operation is the first";
  EXPECT_EQ(report["entities"][0]["name"], "Top by tcp");
  EXPECT_EQ(report["clients"], 2);
}

TEST_F(ServeProcessTest, at_end_exit_ends_it_after_the_recording_with_all_of_it_delivered) {
  const std::string tracking = "unix:" + in_folder("tracking.sock");
  test::Process server({HANDLOFT_MODELD, "serve", "--listen", "unix:" + in_folder("model.sock"), "--tracking",
                        tracking, "--at-end", "exit", "--report", in_folder("report.json")},
                       in_folder("log"));
  ASSERT_TRUE(server.read_line(patience)) << server.error_output();
  TestPeer viewer(net::parse_endpoint("unix:" + in_folder("model.sock")).value(), v1::ROLE_VIEWER, "viewer");
  viewer.join();
  // The recording begins when the viewer is there.
  boost::asio::io_context context;
  auto work = boost::asio::make_work_guard(context);
  const FakeDaemon daemon(context, net::parse_endpoint(tracking).value(), clock_,
                          Logger("test", LogLevel::off));
  std::thread thread([&] { context.run(); });

  EXPECT_TRUE(viewer.read_until([&] { return viewer.closed; })) << "the server hangs up by itself";
  EXPECT_EQ(server.wait(patience), 0) << server.error_output();
  context.stop();
  thread.join();
  EXPECT_EQ(viewer.sequence, 5U) << "all strokes have arrived before";
  EXPECT_FALSE(viewer.entities.at("shape-1").provisional());
  const auto report = nlohmann::json::parse(std::ifstream(in_folder("report.json")));
  EXPECT_EQ(report["sequence"], 5);
  EXPECT_EQ(report["clients"], 1);
}

// A service manager starts again what failed (1), not what another configuration must mend (2).
TEST_F(ServeProcessTest, mistakes_of_the_configuration_end_it_with_2) {
  using Words = std::vector<std::string>;
  const std::string here = "unix:" + in_folder("model.sock");
  for (const Words& words :
       {Words{"--listen", "carrier-pigeon:9"}, Words{"--listen", "tls:127.0.0.1:0"},
        Words{"--listen", here, "--store", in_folder("a"), "--models", in_folder("b")},
        Words{"--listen", "tcp:0.0.0.0:0"}, Words{"--listen", here, "--metrics", "tcp:0.0.0.0:0"},
        Words{"--listen", here, "--people-local-users", "any"}}) {
    Words all{HANDLOFT_MODELD, "serve"};
    all.insert(all.end(), words.begin(), words.end());
    test::Process server(all, in_folder("log"));
    EXPECT_EQ(server.wait(patience), 2) << words.at(1) << " " << words.back() << server.error_output();
  }
}

// Whatever models are made beside it, who names none comes to the same one (U3).
TEST_F(ServeProcessTest, who_names_no_model_comes_to_main) {
  v1::Operation first, other, rename;
  first.mutable_create_dual_shape()->set_id("first");
  other.mutable_create_dual_shape()->set_id("other");
  rename.mutable_rename()->set_entity("first");
  rename.mutable_rename()->set_name("found");
  for (const auto& [model, operation] :
       {std::pair("", &first), std::pair("Alpha", &other), std::pair("", &rename)}) {
    const auto done = outcome_in(model, *operation);
    EXPECT_TRUE(done.ok()) << done.error().describe();
  }
}

TEST_F(ServeProcessTest, who_names_no_model_is_told_when_main_is_damaged) {
  v1::Operation operation;
  operation.mutable_create_dual_shape()->set_id("seat");
  ASSERT_TRUE(outcome_in("", operation).ok());
  ASSERT_TRUE(outcome_in("alpha", operation).ok());
  std::ofstream(in_folder("models/main.handloft")) << "no model any more";
  operation.mutable_create_dual_shape()->set_id("back");
  const auto nameless = outcome_in("", operation);
  ASSERT_FALSE(nameless.ok());
  EXPECT_THAT(nameless.error().describe(), ::testing::HasSubstr("main"));
  EXPECT_TRUE(outcome_in("alpha", operation).ok());
}

// With the half of it the next start would go on as if nothing had been.
TEST_F(ServeProcessTest, a_failing_setup_script_leaves_nothing_in_the_file) {
  const std::vector<std::string> words{HANDLOFT_MODELD, "serve",
                                       "--listen",      "unix:" + in_folder("model.sock"),
                                       "--store",       in_folder("a.handloft"),
                                       "--script",      in_folder("setup.jsonl")};
  std::ofstream(in_folder("setup.jsonl")) << R"({"createDualShape":{"id":"seat"}})"
                                          << "\n"
                                          << R"({"fit":{"entity":"nothing"}})"
                                          << "\n";
  for (int i = 0; i < 2; ++i) {
    test::Process server(words, in_folder("log"));
    EXPECT_EQ(server.wait(patience), 1) << i;
    EXPECT_THAT(server.error_output(), ::testing::HasSubstr("setup.jsonl:2"));
  }
  std::ofstream(in_folder("setup.jsonl")) << R"({"createDualShape":{"id":"seat"}})"
                                          << "\n";
  for (int i = 0; i < 2; ++i) {
    test::Process server(words, in_folder("log"));
    ASSERT_TRUE(server.read_line(patience)) << server.error_output();
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(patience), 0);
    EXPECT_EQ(server.error_output().find("is not run") != std::string::npos, i == 1) << server.error_output();
  }
}

/// Counts how often a file in a folder is put in place, from now on.
class Placed {
 public:
  Placed(const std::string& folder, std::string name)
      : watch_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)), name_(std::move(name)) {
    EXPECT_GE(inotify_add_watch(watch_, folder.c_str(), IN_MOVED_TO), 0);
  }
  ~Placed() { close(watch_); }
  Placed(const Placed&) = delete;
  Placed& operator=(const Placed&) = delete;

  int times() {
    alignas(inotify_event) char buffer[4096];
    for (ssize_t got = 0; (got = read(watch_, buffer, sizeof buffer)) > 0;) {
      for (ssize_t at = 0; at < got;) {
        const auto* event = reinterpret_cast<const inotify_event*>(buffer + at);
        times_ += event->len > 0 && name_ == event->name ? 1 : 0;
        at += static_cast<ssize_t>(sizeof *event + event->len);
      }
    }
    return times_;
  }

 private:
  int watch_;
  std::string name_;
  int times_ = 0;
};

// More than the store lets wait for the disk; what the script writes beside is written once.
TEST_F(ServeProcessTest, a_setup_script_of_any_length_is_done_once) {
  constexpr int operations = 10'000;
  {
    std::ofstream script(in_folder("setup.jsonl"));
    script << R"({"createDualShape":{"id":"seat"}})"
           << "\n"
           << R"({"addPoints":{"entity":"seat","points":[)";
    for (int i = 0; i < 9; ++i)
      script << (i == 0 ? "" : ",") << R"({"pressure":1,"position":{"x":)" << 0.01 * (i % 3) << R"(,"y":)"
             << 0.01 * (i / 3) << R"(,"z":0.01}})";
    script << R"(]}})"
           << "\n"
           << R"({"fit":{"entity":"seat","degree":1}})"
           << "\n"
           << R"({"export":{"path":"seat.obj"}})"
           << "\n";
    for (int i = 3; i < operations; ++i) script << R"({"rename":{"entity":"seat","name":"n)" << i << "\"}}\n";
  }
  Placed placed(folder_.string(), "seat.obj");
  for (int i = 0; i < 2; ++i) {
    test::Process server({HANDLOFT_MODELD, "serve", "--listen", "unix:" + in_folder("model.sock"), "--store",
                          in_folder("a.handloft"), "--script", in_folder("setup.jsonl"), "--report",
                          in_folder("report.json"), "--write-folder", folder_.string()},
                         in_folder("log"));
    ASSERT_TRUE(server.read_line(patience)) << server.error_output();
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(patience), 0) << server.error_output();
    const auto report = nlohmann::json::parse(std::ifstream(in_folder("report.json")));
    EXPECT_EQ(report["sequence"], operations);
    EXPECT_EQ(report["entities"][0]["name"], "n9999");
  }
  EXPECT_EQ(placed.times(), 1);
}

TEST_F(ServeProcessTest, a_failing_setup_script_ends_it_with_the_line) {
  std::ofstream(in_folder("setup.jsonl")) << "\n"
                                          << R"({"fit":{"entity":"nothing"}})"
                                          << "\n";
  test::Process server({HANDLOFT_MODELD, "serve", "--listen", "unix:" + in_folder("model.sock"), "--script",
                        in_folder("setup.jsonl")},
                       in_folder("log"));
  EXPECT_EQ(server.wait(patience), 1);
  EXPECT_THAT(server.error_output(), ::testing::HasSubstr("setup.jsonl:2"));
}

}  // namespace
}  // namespace handloft::session
