// The program itself: how it ends, what it says, what it leaves behind.

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/net/message_client.h"
#include "proto/session.pb.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

constexpr std::chrono::milliseconds patience{30000};

class TrackdProcess : public testing::Test {
 protected:
  std::string endpoint() const { return "unix:" + (folder_.path() / "t.sock").string(); }
  std::filesystem::path report() const { return folder_.path() / "report.json"; }
  nlohmann::json read_report() const {
    std::ifstream in(report());
    return nlohmann::json::parse(in, nullptr, false);
  }
  std::vector<std::string> command(std::vector<std::string> more) const {
    std::vector<std::string> all{test::program("handloft-trackd").string(), "--listen", endpoint(),
                                 "--log-level", "off"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  // Follows the session until `frames` have come.
  void follow(int frames) const {
    const SystemClock clock;
    net::ClientOptions options;
    options.role = v1::ROLE_SUBSCRIBER;
    auto client = net::SyncClient::connect(*net::parse_endpoint(endpoint()), options, clock);
    ASSERT_TRUE(client.ok()) << client.error().describe();
    v1::Envelope subscribe;
    subscribe.mutable_subscribe();
    ASSERT_TRUE(client->send(subscribe).ok());
    for (int i = 0; i < frames; ++i) ASSERT_TRUE(client->receive(patience).ok());
  }
  void expect_refusal(const std::vector<std::string>& arguments, int status, const std::string& words) {
    test::Process process(command(arguments), folder_.path() / "errors.txt");
    EXPECT_EQ(process.wait(patience), std::optional<int>(status));
    EXPECT_NE(process.error_output().find(words), std::string::npos) << process.error_output();
  }

  test::TemporaryDirectory folder_;
};

TEST_F(TrackdProcess, ASignalEndsALiveSessionInOrderWithItsReport) {
  test::Process process(command({"--simulate", "mouse", "--report", report().string()}),
                        folder_.path() / "errors.txt");
  follow(5);
  process.signal(SIGTERM);
  EXPECT_EQ(process.wait(patience), std::optional<int>(0)) << process.error_output();
  const nlohmann::json figures = read_report();
  ASSERT_TRUE(figures.is_object());
  EXPECT_GE(figures["published"], 5);
  EXPECT_EQ(figures["problem"], "");
}

TEST_F(TrackdProcess, AFullDiskEndsTheRecordingButNotTheTracking) {
  // Files may grow to 200 or 400 kB, as sh counts its blocks: some frames. The video ring would be one too.
  // As fast as it goes: in real time a slow machine leaves out frames, and the session may end with too few.
  constexpr int frames = 50;
  const auto recording = (folder_.path() / "a.rec").string();
  std::string line = "ulimit -f 400; exec";
  for (const std::string& word :
       command({"--no-video", "--simulate", "mouse", "--pace", "fast", "--wait-for-subscribers", "1",
                "--record", recording, "--report", report().string()})) {
    line += " '" + word + "'";
  }
  test::Process process({"/bin/sh", "-c", line}, folder_.path() / "errors.txt");
  follow(frames);
  process.signal(SIGTERM);
  EXPECT_EQ(process.wait(patience), std::optional<int>(1));
  EXPECT_NE(process.error_output().find(recording), std::string::npos) << process.error_output();
  const nlohmann::json figures = read_report();
  ASSERT_TRUE(figures.is_object());
  EXPECT_GE(figures["published"], frames) << "tracked on";
  EXPECT_GT(figures["recorded_samples"], 0);
  EXPECT_NE(figures["problem"].get<std::string>().find(recording), std::string::npos);
}

TEST_F(TrackdProcess, NobodySubscribesInTime) {
  expect_refusal({"--simulate", "mouse", "--wait-for-subscribers", "1", "--wait-timeout-s", "0.1"}, 1,
                 "found 0 subscribers after 0.1 s, expected 1");
}

TEST_F(TrackdProcess, ReplaysOfNoRecordingNameTheFile) {
  expect_refusal({"--replay", "/does/not/exist.rec", "--exit-at-end"}, 1, "/does/not/exist.rec");
  const auto path = (folder_.path() / "text.rec").string();
  std::ofstream(path) << "this is no recording";
  expect_refusal({"--replay", path, "--exit-at-end"}, 1, path);
}

TEST_F(TrackdProcess, WithoutCalibrationItSaysHowToMakeOne) {
  const auto missing = (folder_.path() / "calibration.toml").string();
  expect_refusal({"--calibration", missing}, 2, missing + ": make one with handloft-calibrate");
}

}  // namespace
}  // namespace handloft::tracking
