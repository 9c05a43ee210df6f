// Users of a server as its owner and they themselves meet them: `handloft-modeld invite`, `pair`, `run
// --connect tls:`, `users`, `role`, `revoke` and `audit`, beside a server that runs (U2).

#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/net/message_client.h"
#include "common/net/paired_server.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using ::testing::HasSubstr;

constexpr auto patience = 20s;

struct Answer {
  int status = -1;
  std::string text;
  std::string complaint;
};

class AccessProcess : public ::testing::Test {
 protected:
  void SetUp() override {
    server_ = std::make_unique<test::Process>(
        std::vector<std::string>{HANDLOFT_MODELD, "serve", "--listen", "tls:127.0.0.1:0", "--listen",
                                 "unix:" + in_folder("model.sock"), "--access", in_folder("server.sqlite"),
                                 "--config", "deploy/config/modeld.toml"},
        in_folder("server.log"));
    const auto line = server_->read_line(patience);
    ASSERT_TRUE(line) << server_->error_output();
    endpoint_ = json::parse(*line)["endpoints"][0];
  }
  std::string in_folder(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string config(const std::string& who) const { return in_folder(who + "-config"); }

  Answer call(std::vector<std::string> arguments, const std::string& who = "owner") const {
    arguments.insert(arguments.begin(), HANDLOFT_MODELD);
    test::Process process(arguments, in_folder("log"),
                          {"XDG_CONFIG_HOME=" + config(who), "XDG_STATE_HOME=" + in_folder("state")});
    Answer answer;
    answer.text = process.read_all(patience);
    answer.status = process.wait(patience).value_or(-1);
    answer.complaint = process.error_output();
    return answer;
  }
  json owner(std::vector<std::string> arguments) const {
    for (const char* word : {"--json", "--access"}) arguments.emplace_back(word);
    arguments.push_back(in_folder("server.sqlite"));
    const Answer answer = call(arguments);
    EXPECT_EQ(answer.status, 0) << answer.complaint;
    return json::parse(answer.text, nullptr, false);
  }
  Answer pair(const std::string& who, const std::string& code) const {
    return call({"pair", code, "--connect", endpoint_, "--device", who + "'s headset"}, who);
  }
  Answer run(const std::string& who, const std::string& line, const std::string& role = "editor") const {
    std::ofstream(in_folder("script.jsonl")) << line << "\n";
    return call({"run", in_folder("script.jsonl"), "--connect", endpoint_, "--role", role}, who);
  }

  test::TemporaryDirectory folder_;
  std::unique_ptr<test::Process> server_;
  std::string endpoint_;
};

constexpr const char* shape = R"({"create_dual_shape":{}})";
constexpr const char* comment = R"({"add_comment":{"text":"too thin","place":{"x":0.1}}})";

TEST_F(AccessProcess, AnInvitedDeviceShapesAndARevokedOneIsGone) {
  const std::string code = owner({"invite", "--name", "Ann", "--role", "editor"})["code"];
  EXPECT_THAT(run("ann", shape).complaint, HasSubstr("not paired"));
  const Answer paired = pair("ann", code);
  ASSERT_EQ(paired.status, 0) << paired.complaint;
  EXPECT_THAT(paired.text, HasSubstr("as Ann, editor"));
  EXPECT_EQ(pair("eve", code).status, 1) << "a code works once";
  EXPECT_EQ(run("ann", shape).status, 0);
  EXPECT_THAT(
      run("ann", shape, "owner").complaint + run("ann", R"({"delete_version":{"name":"v"}})", "owner").text,
      HasSubstr("permission_denied"));

  // Somebody who is there while it happens.
  const json users = owner({"users"});
  ASSERT_EQ(users["users"][0]["name"], "Ann");
  const std::string fingerprint = users["users"][0]["devices"][0]["fingerprint"];
  const auto known =
      net::find_paired_server(*net::parse_endpoint(endpoint_), config("ann") + "/handloft/servers");
  ASSERT_TRUE(known.ok()) << known.error().describe();
  net::ClientOptions options;
  options.role = v1::ROLE_VIEWER;
  options.tls = *net::TlsContext::for_client(known->identity, known->authority_pem);
  const SystemClock clock;
  auto client = net::SyncClient::connect(*net::parse_endpoint(endpoint_), options, clock);
  ASSERT_TRUE(client.ok()) << client.error().describe();
  owner({"revoke", "--device", fingerprint.substr(0, 12)});
  const auto begin = std::chrono::steady_clock::now();
  Result<v1::Envelope> last = client->receive(5s);
  while (last.ok() && !last->has_failure()) last = client->receive(5s);
  ASSERT_TRUE(last.ok()) << last.error().describe();
  EXPECT_EQ(last->failure().code(), "permission_denied");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s);
  EXPECT_EQ(run("ann", shape).status, 2);
  EXPECT_THAT(run("ann", shape).complaint, HasSubstr("revoked"));
}

TEST_F(AccessProcess, RolesAreGivenAndWrittenDown) {
  ASSERT_EQ(
      pair("bob", owner({"invite", "--name", "Bob", "--role", "commenter", "--valid", "2m"})["code"]).status,
      0);
  EXPECT_EQ(run("bob", comment, "commenter").status, 0);
  EXPECT_THAT(run("bob", shape, "commenter").text,
              HasSubstr("commenter may not do create_dual_shape, expected editor"));
  owner({"role", "Bob", "editor"});
  // The server follows within a second.
  Answer answer;
  for (const auto until = std::chrono::steady_clock::now() + 5s; std::chrono::steady_clock::now() < until;) {
    answer = run("bob", shape);
    if (answer.status == 0) break;
  }
  EXPECT_EQ(answer.status, 0) << answer.text << answer.complaint;
  const json audit = owner({"audit", "--count", "100"});
  std::vector<std::string> kinds;
  for (const json& entry : audit["entries"]) kinds.push_back(entry["kind"]);
  EXPECT_THAT(kinds, ::testing::IsSupersetOf({"invite", "pairing", "refusal", "role"}));
  EXPECT_THAT(call({"audit", "--access", in_folder("server.sqlite")}).text,
              HasSubstr("commenter may not do"));
}

TEST_F(AccessProcess, AnInvitationIsSeenAndWithdrawn) {
  const std::string code = owner({"invite", "--name", "Mallory", "--role", "owner"})["code"];
  const json open = owner({"users"})["invitations"];
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0]["user"], "Mallory");
  EXPECT_EQ(open[0]["role"], "owner");
  EXPECT_EQ(open[0]["model"], "*");
  EXPECT_THAT(call({"users", "--access", in_folder("server.sqlite")}).text,
              HasSubstr("invited: Mallory, owner on every model, until 20"));
  const Answer revoked = call({"revoke", "Mallory", "--access", in_folder("server.sqlite")});
  EXPECT_EQ(revoked.status, 0) << revoked.complaint;
  EXPECT_EQ(revoked.text, "Mallory was only invited; withdrawn: 1 invitation\n");
  const Answer refused = pair("mallory", code);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.complaint, HasSubstr("permission_denied"));
  EXPECT_TRUE(owner({"users"})["invitations"].empty());
  EXPECT_EQ(call({"revoke", "Mallory", "--access", in_folder("server.sqlite")}).status, 1);

  ASSERT_EQ(pair("ann", owner({"invite", "--name", "Ann"})["code"]).status, 0);
  owner({"invite", "--name", "Ann"});
  EXPECT_EQ(call({"revoke", "Ann", "--access", in_folder("server.sqlite")}).text,
            "Ann is revoked; withdrawn: 1 device, 1 role, 1 invitation\n");
}

TEST_F(AccessProcess, ARoleIsToldAsItResults) {
  const auto role = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "role");
    words.insert(words.end(), {"--access", in_folder("server.sqlite")});
    return call(words);
  };
  EXPECT_EQ(role({"Ann", "editor"}).text, "Ann is now editor on every model\n");
  EXPECT_EQ(role({"Ann", "viewer", "--model", "nope"}).text,
            "Ann is now viewer on \"nope\"\n  still editor, by every model\n");
  EXPECT_EQ(role({"Ann", "owner", "--model", "seat"}).text, "Ann is now owner on \"seat\"\n");
  EXPECT_EQ(role({"Ann", "none", "--model", "nope"}).text,
            "Ann is now none on \"nope\"\n  still editor, by every model\n");
  const json told = owner({"role", "Ann", "viewer"});
  EXPECT_EQ(told["results"], "viewer");
  EXPECT_EQ(told["still"], json::parse(R"([{"model":"seat","role":"owner"}])"));
  owner({"invite", "--name", "Ann", "--role", "editor"});
  EXPECT_THAT(role({"Ann", "commenter"}).text, HasSubstr("  still owner on \"seat\"\n  invited: editor on "));
  EXPECT_EQ(role({"Ann", "none"}).text,
            "Ann is now none on every model\n  still owner on \"seat\"\n  withdrawn: 1 role, 1 invitation\n");

  const Answer zoe = role({"Zoe", "none"});
  EXPECT_EQ(zoe.status, 1);
  EXPECT_THAT(zoe.complaint, HasSubstr("not_found: user: there is neither a user nor an invitation \"Zoe\""));
  const Answer outside = role({"Ann", "viewer", "--model", "../x"});
  EXPECT_EQ(outside.status, 2);
  EXPECT_THAT(outside.complaint, HasSubstr("model: found \"../x\""));
  EXPECT_EQ(
      call({"invite", "--name", "A", "--model", "../x", "--access", in_folder("missing.sqlite")}).status, 2);
  EXPECT_FALSE(std::filesystem::exists(in_folder("missing.sqlite"))) << "nor is a file begun for it";
}

TEST_F(AccessProcess, TheServersOwnConfigurationSaysWhichFile) {
  const std::string path = in_folder("modeld.toml");
  {
    std::ifstream example("deploy/config/modeld.toml");
    std::ofstream(path) << "access = '" << in_folder("server.sqlite")
                        << "'\nlisten = ['tls:127.0.0.1:0']\nmodels = '/nowhere'\n"
                        << example.rdbuf();
  }
  const Answer invited = call({"invite", "--name", "Ann", "--config", path, "--json"});
  ASSERT_EQ(invited.status, 0) << invited.complaint;
  ASSERT_EQ(pair("ann", json::parse(invited.text)["code"]).status, 0) << "of the server that runs";
  EXPECT_THAT(call({"users", "--config", path}).text, HasSubstr("Ann"));
  EXPECT_EQ(call({"role", "Ann", "viewer", "--config", path}).status, 0);
  EXPECT_EQ(call({"audit", "--config", path}).status, 0);
  EXPECT_EQ(call({"revoke", "Ann", "--config", path}).status, 0);
  EXPECT_EQ(call({"users", "--config", path, "--access", in_folder("missing.sqlite")}).status, 1)
      << "a flag beats the file";
  std::ofstream(path, std::ios::app) << "max_conections = 3\n";
  const Answer mistyped = call({"users", "--config", path});
  EXPECT_EQ(mistyped.status, 2);
  EXPECT_THAT(mistyped.complaint, HasSubstr("people.max_conections"));
}

TEST_F(AccessProcess, WrongUseIsToldInWords) {
  EXPECT_EQ(call({"invite", "--access", in_folder("server.sqlite")}).status, 2) << "nobody is named";
  EXPECT_EQ(
      call({"invite", "--name", "A", "--valid", "forever", "--access", in_folder("server.sqlite")}).status,
      2);
  EXPECT_EQ(call({"revoke", "Nobody", "--access", in_folder("server.sqlite")}).status, 1);
  // Only an invitation begins a file: of a mistyped name one would believe that it is done.
  const std::vector<std::vector<std::string>> commands{
      {"users"}, {"audit"}, {"role", "Zo", "none"}, {"role", "Zo", "editor"}, {"revoke", "Zo"}};
  for (std::vector<std::string> command : commands) {
    const std::string name = command[0];
    const Answer nowhere = call(command);  // nor the usual one, of a home that has none
    EXPECT_EQ(nowhere.status, 1) << name;
    EXPECT_THAT(nowhere.complaint, HasSubstr("not_found: access: \"" + in_folder("state"))) << name;
    command.insert(command.end(), {"--access", in_folder("missing.sqlite")});
    const Answer answer = call(command);
    EXPECT_EQ(answer.status, 1) << name;
    EXPECT_EQ(answer.text, "") << name;
    EXPECT_THAT(answer.complaint, HasSubstr("not_found: access: \"" + in_folder("missing.sqlite"))) << name;
  }
  EXPECT_FALSE(std::filesystem::exists(in_folder("missing.sqlite")));
  EXPECT_FALSE(std::filesystem::exists(in_folder("state")));
  EXPECT_THAT(call({"invite", "--name", "A", "--access", in_folder("missing.sqlite")}).text,
              HasSubstr("missing.sqlite\" is new"));
  EXPECT_THAT(call({"invite", "--name", "A", "--access", in_folder("missing.sqlite")}).text,
              ::testing::StartsWith("For A, editor"));
  EXPECT_THAT(pair("eve", "ABCDE").complaint, HasSubstr("found 5 signs, expected 40"));
  EXPECT_THAT(pair("eve", std::string(40, '2')).complaint, HasSubstr("mistyped"));
}

}  // namespace
}  // namespace handloft
