// A new device: invited by the server's owner, paired by handloft-hmd with the code, and from then on let in
// by its certificate alone, until it is revoked (U2). Everything is real: processes, TLS, files. What a
// person reads when it fails, and the exit status (client-hmd/main/exit_status.h), are part of it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client-hmd/main/exit_status.h"
#include "client-hmd/render/image.h"
#include "common/net/pairing_code.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::e2e {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

constexpr auto patience = 60s;

class ClientPairing : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream script(path("scene.jsonl"));
    json points = json::array();
    for (int j = -8; j <= 8; ++j) {
      for (int i = -8; i <= 8; ++i) {
        const double x = 0.008 * i, y = 0.006 * j;
        points.push_back(
            {{"position", {{"x", x}, {"y", y}, {"z", 0.05 - 5 * x * x - 8 * y * y}}}, {"pressure", 0.8}});
      }
    }
    script << json{{"addPoints", {{"entity", "top"}, {"create", {{"degree", 2}}}, {"points", points}}}}
           << "\n"
           << json{{"fit", {{"entity", "top"}}}} << "\n";
    script.close();
    modeld_ = std::make_unique<test::Process>(
        std::vector<std::string>{test::program("handloft-modeld"), "serve", "--listen", "tls:127.0.0.1:0",
                                 "--access", path("access.sqlite"), "--script", path("scene.jsonl")},
        path("modeld.log"));
    const auto line = modeld_->read_line(patience);
    ASSERT_TRUE(line) << modeld_->error_output();
    endpoint_ = json::parse(*line)["endpoints"][0];
  }

  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  json access(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), test::program("handloft-modeld"));
    arguments.insert(arguments.end(), {"--access", path("access.sqlite"), "--json"});
    test::Process process(arguments, path("access.log"));
    const std::string text = process.read_all(patience);
    EXPECT_EQ(process.wait(patience), 0) << process.error_output();
    return json::parse(text, nullptr, false);
  }
  std::string invite(const std::string& role) {
    const json invitation = access({"invite", "--name", "Ann", "--role", role});
    EXPECT_TRUE(invitation.contains("code")) << invitation;
    return invitation.value("code", "");
  }

  struct Ended {
    int status = -1;
    std::string words;
  };
  std::unique_ptr<test::Process> start(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{test::program("handloft-hmd"),
                                 "--model",
                                 endpoint_,
                                 "--offscreen",
                                 "--size",
                                 "320x240",
                                 "--view",
                                 "fit"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return std::make_unique<test::Process>(
        all, path("hmd-" + std::to_string(++runs_) + ".log"),
        std::vector<std::string>{"XDG_CONFIG_HOME=" + path("config"), "XDG_STATE_HOME=" + path("state")});
  }
  Ended run(const std::vector<std::string>& arguments) {
    const auto hmd = start(arguments);
    const std::optional<int> status = hmd->wait(patience);
    EXPECT_TRUE(status.has_value()) << "it does not end: " << hmd->error_output();
    return {status.value_or(-1), hmd->error_output()};
  }
  Ended picture(const std::vector<std::string>& arguments = {}) {
    std::vector<std::string> all{"--once", "--screenshot", path("view.png")};
    all.insert(all.end(), arguments.begin(), arguments.end());
    fs::remove(path("view.png"));
    return run(all);
  }
  /// Pixels in the shape's colour.
  int strong_pixels() const {
    const Result<client::Image> image = client::read_png(path("view.png"));
    EXPECT_TRUE(image.ok()) << image.error().describe();
    if (!image) return 0;
    EXPECT_EQ(image->width_px, 320);
    // Lacquer is blue: nothing of the table is as much.
    int count = 0;
    for (std::size_t i = 0; i + 3 < image->rgba.size(); i += 4) {
      if (image->rgba[i + 2] > image->rgba[i] + 30) ++count;
    }
    return count;
  }
  bool kept_anything() const { return fs::exists(path("config/handloft/servers")); }

  test::TemporaryDirectory folder_;
  std::unique_ptr<test::Process> modeld_;
  std::string endpoint_;
  int runs_ = 0;
};

TEST_F(ClientPairing, LetsADeviceInByItsCertificateFromThenOn_U2) {
  const Ended unpaired = picture();
  EXPECT_EQ(unpaired.status, client::exit_refused);
  EXPECT_THAT(unpaired.words, HasSubstr("not paired"));
  EXPECT_THAT(unpaired.words, HasSubstr("handloft-hmd --pair CODE --model " + endpoint_));

  const Ended paired = picture({"--pair", invite("viewer")});
  ASSERT_EQ(paired.status, client::exit_ok) << paired.words;
  EXPECT_THAT(paired.words, HasSubstr("paired with " + endpoint_ + " as \"Ann\", viewer"));
  const int shape = strong_pixels();
  EXPECT_GT(shape, 300) << "the model is in the picture";

  const Ended again = picture();
  ASSERT_EQ(again.status, client::exit_ok) << again.words;
  EXPECT_THAT(again.words, Not(HasSubstr("paired with")));
  EXPECT_EQ(strong_pixels(), shape);
  if (const char* keep = std::getenv("HANDLOFT_KEEP_PICTURES"); keep != nullptr) {
    fs::copy_file(path("view.png"), fs::path(keep) / "client_pairing.png",
                  fs::copy_options::overwrite_existing);
  }
  for (const auto& entry : fs::recursive_directory_iterator(path("config/handloft/servers"))) {
    EXPECT_EQ(entry.status().permissions() & (fs::perms::group_all | fs::perms::others_all), fs::perms::none)
        << entry.path();
  }
}

TEST_F(ClientPairing, SaysWhatIsWrongWithACodeAndKeepsNothing_U2) {
  const std::string code = invite("editor");
  Result<net::PairingCode> guessed = net::read_pairing_code(code);
  ASSERT_TRUE(guessed.ok()) << code;
  guessed->secret ^= 1U;
  const Ended wrong = picture({"--pair", net::write_pairing_code(*guessed)});
  EXPECT_EQ(wrong.status, client::exit_refused) << wrong.words;
  EXPECT_THAT(wrong.words, HasSubstr("the code is wrong, used or too old: ask for a new one"));
  EXPECT_FALSE(kept_anything());

  ASSERT_EQ(picture({"--pair", code}).status, client::exit_ok);
  fs::remove_all(path("config"));
  const Ended used = picture({"--pair", code});
  EXPECT_EQ(used.status, client::exit_refused) << used.words;
  EXPECT_THAT(used.words, HasSubstr("the code is wrong, used or too old: ask for a new one"));
  EXPECT_FALSE(kept_anything());
  EXPECT_FALSE(fs::exists(path("view.png")));

  std::string one_sign_off = code;
  one_sign_off.back() = code.back() == '7' ? '8' : '7';
  const Ended mistyped = picture({"--pair", one_sign_off});
  EXPECT_EQ(mistyped.status, client::exit_usage) << mistyped.words;
  EXPECT_THAT(mistyped.words, HasSubstr("mistyped"));
  EXPECT_FALSE(kept_anything());
  const Ended no_code = picture({"--pair", "hello"});
  EXPECT_EQ(no_code.status, client::exit_usage) << no_code.words;
  EXPECT_THAT(no_code.words, HasSubstr("code"));

  // A code is good for a minute at least: this one is made older than it is.
  const std::string expired = invite("editor");
  sqlite3* file = nullptr;
  ASSERT_EQ(sqlite3_open(path("access.sqlite").c_str(), &file), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(file, "UPDATE invitations SET until_s = 1", nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(file);
  sqlite3_close(file);
  const Ended late = picture({"--pair", expired});
  EXPECT_EQ(late.status, client::exit_refused) << late.words;
  EXPECT_THAT(late.words, HasSubstr("too old: ask for a new one"));
  EXPECT_FALSE(kept_anything());
}

TEST_F(ClientPairing, EndsARevokedDeviceInTheServersWords_U2) {
  ASSERT_EQ(picture({"--pair", invite("viewer")}).status, client::exit_ok);
  const auto watching = start({"--log-level", "debug"});
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (watching->error_output().find("has the scene") == std::string::npos &&
         std::chrono::steady_clock::now() < deadline) {
    ASSERT_FALSE(watching->wait(20ms).has_value()) << watching->error_output();
  }
  const json users = access({"users"});
  std::string fingerprint;
  for (const json& user : users.value("users", json::array())) {
    for (const json& device : user["devices"]) fingerprint = device.value("fingerprint", "");
  }
  ASSERT_EQ(fingerprint.size(), 64U) << users;
  access({"revoke", "--device", fingerprint});
  EXPECT_EQ(watching->wait(patience), client::exit_refused)
      << "one that is connected: " << watching->error_output();
  EXPECT_THAT(watching->error_output(), HasSubstr("revoked"));

  const Ended again = picture();
  EXPECT_EQ(again.status, client::exit_refused) << again.words;
  EXPECT_THAT(again.words, HasSubstr("this device was revoked"));
  EXPECT_FALSE(fs::exists(path("view.png")));
}

}  // namespace
}  // namespace handloft::e2e
