// "One model, many users, nothing lost", with everything real: two users at workstations of their own (a
// tracking daemon and a viewer each) and a script shape one car seat together, by TLS on loopback, each with
// the identity that was paired for them. One workstation crashes in mid-work (SIGKILL) and comes back. In the
// end both see the same, both export the same STEP file, and the server's log, replayed, exports it again.

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/net/message_client.h"
#include "common/net/paired_server.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::e2e {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr auto patience = 120s;
constexpr std::size_t crashes_after = 3;  ///< Of Bob's operations.

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// But for the line that says what the file is called and when it was written.
std::string without_name(std::string text) {
  const std::size_t begin = text.find("FILE_NAME(");
  if (begin != std::string::npos) text.erase(begin, text.find('\n', begin) - begin);
  return text;
}

/// The operations of the car seat's script: those of one shape of the three that are made first, or what
/// comes after.
struct Seat {
  std::vector<v1::Operation> cushion, back, head_rest, rest;
};
Seat seat() {
  Seat result;
  std::ifstream script("tests/data/scripts/car_seat.jsonl");
  for (std::string line; std::getline(script, line);) {
    v1::Operation operation;
    if (line.empty() || line[0] == '#' ||
        !google::protobuf::util::JsonStringToMessage(line, &operation).ok() || operation.has_export_()) {
      continue;  // What the script expects and asks.
    }
    const json words = json::parse(line).front();
    const std::string shape = words.value("entity", words.value("id", std::string()));
    auto& list = !result.rest.empty()   ? result.rest
                 : shape == "cushion"   ? result.cushion
                 : shape == "back"      ? result.back
                 : shape == "head-rest" ? result.head_rest
                                        : result.rest;
    list.push_back(std::move(operation));
  }
  return result;
}

/// An editor at work, who is the same one after a crash: the key is kept, and so are the operations' numbers.
class Editor {
 public:
  Editor(net::Endpoint endpoint, const fs::path& config, std::string name)
      : endpoint_(std::move(endpoint)), name_(std::move(name)), key_(32, name_[0]) {
    const auto server = net::find_paired_server(endpoint_, config / "handloft" / "servers");
    EXPECT_TRUE(server.ok()) << server.error().describe();
    if (!server) return;
    auto tls = net::TlsContext::for_client(server->identity, server->authority_pem);
    EXPECT_TRUE(tls.ok()) << tls.error().describe();
    if (tls) tls_ = *std::move(tls);
    connect();
  }
  void connect() {
    net::ClientOptions options;
    options.role = v1::ROLE_EDITOR;
    options.name = name_;
    options.client_key = key_;
    options.tls = tls_;
    auto client = net::SyncClient::connect(endpoint_, options, clock_);
    ASSERT_TRUE(client.ok()) << client.error().describe();
    client_ = std::make_unique<net::SyncClient>(*std::move(client));
    v1::Envelope join;
    join.mutable_join();
    ASSERT_TRUE(client_->send(join).ok());
  }
  /// Gone without a word; what was sent may have arrived.
  void crash() { client_.reset(); }
  void send(const v1::Operation& operation, std::uint64_t number) {
    v1::Envelope envelope;
    envelope.mutable_submit()->set_request(number);
    envelope.mutable_submit()->set_answer_when(operation.has_export_() ? v1::SAVE_LEVEL_UNSPECIFIED
                                                                       : v1::SAVE_LEVEL_DURABLE);
    *envelope.mutable_submit()->mutable_operation() = operation;
    envelope.mutable_submit()->mutable_operation()->set_client_op_id(number);
    ASSERT_TRUE(client_->send(envelope).ok());
  }
  void wait_for(std::uint64_t number) {
    for (;;) {
      const auto envelope = client_->receive(patience);
      ASSERT_TRUE(envelope.ok()) << name_ << ": " << envelope.error().describe();
      if (!envelope->has_ack() || envelope->ack().request() != number) continue;
      ASSERT_FALSE(envelope->ack().has_failure()) << name_ << ": " << envelope->ack().failure().message();
      return;
    }
  }
  void submit(const v1::Operation& operation) {
    send(operation, ++number_);
    if (!testing::Test::HasFatalFailure()) wait_for(number_);
  }
  std::uint64_t next_number() { return ++number_; }

 private:
  SystemClock clock_;
  const net::Endpoint endpoint_;
  const std::string name_, key_;
  std::shared_ptr<const net::TlsContext> tls_;
  std::unique_ptr<net::SyncClient> client_;
  std::uint64_t number_ = 0;
};

class TwoWorkstations : public testing::Test {
 protected:
  std::string in_folder(const std::string& name) const { return (folder_.path() / name).string(); }
  fs::path config(const std::string& who) const { return folder_.path() / (who + "-config"); }

  void serve() {
    fs::create_directory(in_folder("exports"));
    server_ = std::make_unique<test::Process>(
        std::vector<std::string>{test::program("handloft-modeld"), "serve", "--listen", "tls:127.0.0.1:0",
                                 "--access", in_folder("access.sqlite"), "--store",
                                 in_folder("seat.handloft"), "--write-folder", in_folder("exports")},
        in_folder("server.log"));
    const auto line = server_->read_line(patience);
    ASSERT_TRUE(line) << server_->error_output();
    endpoint_ = json::parse(*line)["endpoints"][0];
  }
  json command(std::vector<std::string> arguments, const std::string& who) {
    arguments.insert(arguments.begin(), test::program("handloft-modeld"));
    arguments.emplace_back("--json");
    test::Process process(arguments, in_folder("command.log"), {"XDG_CONFIG_HOME=" + config(who).string()});
    const std::string text = process.read_all(patience);
    EXPECT_EQ(process.wait(patience), 0) << process.error_output();
    return json::parse(text, nullptr, false);
  }
  void pair(const std::string& who) {
    const json invitation =
        command({"invite", "--name", who, "--role", "editor", "--access", in_folder("access.sqlite")}, who);
    ASSERT_TRUE(invitation.contains("code")) << invitation;
    command({"pair", invitation["code"], "--connect", endpoint_}, who);
  }
  Editor editor(const std::string& who) const {
    return {net::parse_endpoint(endpoint_).value(), config(who), who};
  }

  /// A simulated hand before simulated cameras, and what its user sees.
  struct Workstation {
    std::unique_ptr<test::Process> trackd, hmd;
  };
  Workstation workstation(const std::string& who, const std::string& time) {
    const std::string tracking = "unix:" + in_folder(who + time + ".sock");
    const std::vector<std::string> own{"XDG_CONFIG_HOME=" + config(who).string()};
    Workstation result;
    result.trackd = std::make_unique<test::Process>(
        std::vector<std::string>{test::program("handloft-trackd"), "--simulate", "mouse", "--listen",
                                 tracking, "--camera-rate-hz", "10"},
        in_folder(who + time + "-trackd.log"), own);
    result.hmd = std::make_unique<test::Process>(
        std::vector<std::string>{test::program("handloft-hmd"), "--model", endpoint_, "--tracking", tracking,
                                 "--offscreen", "--size", "320x240", "--frame-rate", "5", "--view", "fit",
                                 "--report", in_folder(who + ".json"), "--log-level", "debug"},
        in_folder(who + time + "-hmd.log"), own);
    return result;
  }
  static bool has_scene(const test::Process& hmd) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (std::chrono::steady_clock::now() < deadline) {
      if (hmd.error_output().find("has the scene") != std::string::npos) return true;
      std::this_thread::sleep_for(20ms);
    }
    return false;
  }
  json finish(const Workstation& workstation, const std::string& who) {
    workstation.hmd->signal(SIGTERM);
    EXPECT_EQ(workstation.hmd->wait(patience), 0) << workstation.hmd->error_output();
    workstation.trackd->signal(SIGTERM);
    workstation.trackd->wait(patience);
    return json::parse(bytes_of(in_folder(who + ".json")), nullptr, false);
  }

  test::TemporaryDirectory folder_;
  std::unique_ptr<test::Process> server_;
  std::string endpoint_;
};

TEST_F(TwoWorkstations, ShapeOneSeatWithAScriptAndNothingIsLost) {
  const Seat seat = e2e::seat();
  ASSERT_GT(seat.back.size(), crashes_after + 2);
  ASSERT_GT(seat.cushion.size(), 4U);
  ASSERT_GT(seat.head_rest.size(), 4U);
  ASSERT_NO_FATAL_FAILURE(serve());
  for (const char* who : {"Ann", "Bob", "Script"}) ASSERT_NO_FATAL_FAILURE(pair(who));
  Workstation anns = workstation("Ann", "");
  Workstation bobs = workstation("Bob", "");
  ASSERT_TRUE(has_scene(*anns.hmd)) << anns.hmd->error_output();
  ASSERT_TRUE(has_scene(*bobs.hmd)) << bobs.hmd->error_output();

  Editor ann = editor("Ann"), bob = editor("Bob"), script = editor("Script");
  std::thread ann_works([&] {
    for (const v1::Operation& operation : seat.cushion) ann.submit(operation);
  });
  std::thread script_works([&] {
    for (const v1::Operation& operation : seat.head_rest) script.submit(operation);
  });
  for (std::size_t i = 0; i < seat.back.size(); ++i) {
    if (i != crashes_after) {
      bob.submit(seat.back[i]);
      continue;
    }
    const std::uint64_t number = bob.next_number();
    bob.send(seat.back[i], number);
    for (const auto& process : {&bobs.hmd, &bobs.trackd}) {
      (*process)->signal(SIGKILL);
      EXPECT_EQ((*process)->wait(patience), 128 + SIGKILL);
    }
    bob.crash();
    bobs = workstation("Bob", "-again");
    bob.connect();
    bob.send(seat.back[i], number);  // Nobody knows whether it was done.
    bob.wait_for(number);
  }
  ann_works.join();
  script_works.join();
  for (const v1::Operation& operation : seat.rest) script.submit(operation);
  ASSERT_FALSE(HasFailure());

  v1::Operation out;
  out.mutable_export_()->set_path("seat-of-ann.step");
  ann.submit(out);
  out.mutable_export_()->set_path("seat-of-bob.step");
  bob.submit(out);
  ASSERT_TRUE(has_scene(*bobs.hmd)) << bobs.hmd->error_output();
  std::this_thread::sleep_for(2s);  // Ten frames: to draw what came last. Nothing else waits for it.
  const json ann_saw = finish(anns, "Ann"), bob_saw = finish(bobs, "Bob");
  server_->signal(SIGTERM);
  ASSERT_EQ(server_->wait(patience), 0) << server_->error_output();

  ASSERT_TRUE(ann_saw.contains("scene") && bob_saw.contains("scene"));
  EXPECT_EQ(ann_saw["scene"]["points"], bob_saw["scene"]["points"]);
  EXPECT_EQ(ann_saw["scene"]["triangles"], bob_saw["scene"]["triangles"]);
  EXPECT_GT(bob_saw["scene"]["triangles"].get<int>(), 1000);
  EXPECT_EQ(ann_saw["messages_refused"], 0);
  EXPECT_EQ(bob_saw["messages_refused"], 0);
  const json verified = command({"verify", in_folder("seat.handloft")}, "Ann");
  command({"export", in_folder("seat.handloft"), in_folder("exports/seat-of-log.step")}, "Ann");
  EXPECT_GT(fs::file_size(in_folder("exports/seat-of-ann.step")), 10'000U);
  const auto content = [&](const std::string& who) {
    return without_name(bytes_of(in_folder("exports/seat-of-" + who + ".step")));
  };
  // Megabytes: a failure must not show them.
  EXPECT_TRUE(content("ann") == content("bob"));
  EXPECT_TRUE(content("ann") == content("log"));
  const std::size_t operations =
      seat.cushion.size() + seat.back.size() + seat.head_rest.size() + seat.rest.size();
  EXPECT_EQ(verified["operations"], operations) << "each is there once";
  EXPECT_EQ(verified["good"], true);
}

}  // namespace
}  // namespace handloft::e2e
