// A recording replays to the same bits (T13): what subscribers get is a function of the recorded samples, in
// their recorded order, whether the vision ran on workers in real time or on one thread.

#include <gtest/gtest.h>

#include <fstream>
#include <future>
#include <set>
#include <thread>

#include "common/net/message_client.h"
#include "daemon-tracking/main/daemon.h"
#include "daemon-tracking/main/sample_recorder.h"
#include "daemon-tracking/source/pen/pen_streams.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/source/space_mouse/space_mouse_streams.h"
#include "proto/session.pb.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

constexpr std::chrono::milliseconds patience{20000};
constexpr double session_s = 0.6;
const Logger quiet("test", LogLevel::off);

// Half a second or so in front of the simulated cameras.
void record_session(const std::filesystem::path& path) {
  HandProgram program;
  program.gesture(HandPose::pointing, {0.02, 0.01, 0.1}, 0.1);
  SimulatedRigOptions options;
  options.start = from_ns(5'000'000'000);
  // A pen and a 3D mouse beside cameras and glove: all devices' bytes are in the recording.
  SimulatedPenOptions pen;
  pen.start = options.start;
  pen.seconds = session_s;
  SimulatedSpaceMouseOptions mouse;
  mouse.start = options.start;
  mouse.seconds = session_s;
  std::vector<std::unique_ptr<SampleStream>> streams;
  streams.push_back(std::make_unique<SimulatedRig>(default_rig(), std::move(program), options));
  streams.push_back(simulated_pen_stream(pen));
  streams.push_back(simulated_space_mouse_stream(mouse));
  MergedStream rig(std::move(streams));
  const SystemClock clock;
  auto recorder = SampleRecorder::create(path, {{"rig", "default"}}, clock, quiet);
  ASSERT_TRUE(recorder.ok()) << recorder.error().describe();
  while (std::optional<Sample> sample = rig.next()) (*recorder)->record(std::move(*sample));
  ASSERT_TRUE((*recorder)->finish().ok());
}

DaemonOptions replaying(const std::filesystem::path& file) {
  DaemonOptions options;
  options.replay.emplace(file.string());
  return options;
}

struct Replayed {
  std::vector<std::string> frames;  // as bytes, without the publish time
  bool ended = false;
  std::optional<Error> error;  // the daemon's own
};

// Runs the daemon with one subscriber to every frame.
Replayed run(DaemonOptions options, const std::filesystem::path& folder) {
  const SystemClock clock;
  options.listen = "unix:" + (folder / "t.sock").string();
  options.wait_for_subscribers = 1;
  options.wait_timeout_s = 10;
  options.exit_at_end = true;
  SessionControl control;
  auto daemon = std::async(std::launch::async, [&] { return run_daemon(options, clock, quiet, control); });

  net::ClientOptions client_options;
  client_options.role = v1::ROLE_SUBSCRIBER;
  auto client = net::SyncClient::connect(*net::parse_endpoint(options.listen), client_options, clock);
  EXPECT_TRUE(client.ok()) << client.error().describe();
  v1::Envelope subscribe;
  subscribe.mutable_subscribe()->set_delivery(v1::Subscribe::EVERY);
  EXPECT_TRUE(client->send(subscribe).ok());
  Replayed replayed;
  while (!replayed.ended) {
    auto message = client->receive(patience);
    EXPECT_TRUE(message.ok()) << message.error().describe();
    if (!message.ok()) break;
    v1::TrackingFrame& frame = *message->mutable_tracking();
    replayed.ended = frame.end_of_recording();
    frame.clear_publish_time_ns();  // These two are measured on the daemon's clock.
    frame.clear_latency();
    replayed.frames.push_back(frame.SerializeAsString());
  }
  { const net::SyncClient gone = std::move(*client); }  // or the daemon would wait for it to leave
  const auto session = daemon.get();
  replayed.error = session.ok() ? session->problem : session.error();
  return replayed;
}

TEST(Replay, TheSameRecordingGivesTheSameBitsTwiceT13) {
  const test::TemporaryDirectory folder;
  record_session(folder.path() / "a.rec");
  const DaemonOptions options = replaying(folder.path() / "a.rec");
  const Replayed first = run(options, folder.path());
  const Replayed second = run(options, folder.path());
  EXPECT_TRUE(first.ended);
  EXPECT_GT(first.frames.size(), 20u);
  EXPECT_EQ(first.frames, second.frames);
  EXPECT_FALSE(first.error.has_value());
}

TEST(Replay, EverySpeedGivesTheSameBitsT13) {
  const test::TemporaryDirectory folder;
  record_session(folder.path() / "a.rec");
  DaemonOptions options = replaying(folder.path() / "a.rec");
  const Replayed fast = run(options, folder.path());
  std::vector<double> seconds;
  for (const double speed : {1.0, 100.0}) {
    options.speed = speed;
    const auto began = std::chrono::steady_clock::now();
    EXPECT_EQ(run(options, folder.path()).frames, fast.frames) << "at speed " << speed;
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
  }
  EXPECT_GT(seconds[0], session_s * 0.8) << "as it was";
}

TEST(Replay, PensAndMiceAreInTheFramesT13) {
  const test::TemporaryDirectory folder;
  record_session(folder.path() / "a.rec");
  const Replayed replayed = run(replaying(folder.path() / "a.rec"), folder.path());
  ASSERT_FALSE(replayed.frames.empty());
  v1::TrackingFrame last;
  ASSERT_TRUE(last.ParseFromString(replayed.frames.back()));
  std::set<std::string> devices;
  for (const v1::DeviceHealth& device : last.devices())
    if (device.samples() > 0) devices.insert(device.device());
  EXPECT_EQ(devices, (std::set<std::string>{"camera/head", "camera/left", "camera/right", "glove", "pen",
                                            "space_mouse"}));
  EXPECT_TRUE(last.has_pen());
  EXPECT_TRUE(last.has_space_mouse());
}

TEST(Replay, SeveralTimesOverGoesOnInTime) {
  const test::TemporaryDirectory folder;
  record_session(folder.path() / "a.rec");
  DaemonOptions options = replaying(folder.path() / "a.rec");
  options.repeat = 3;
  const Replayed replayed = run(options, folder.path());
  EXPECT_TRUE(replayed.ended);
  std::int64_t time = 0;
  std::uint64_t sequence = 0;
  for (const std::string& bytes : replayed.frames) {
    v1::TrackingFrame frame;
    ASSERT_TRUE(frame.ParseFromString(bytes));
    EXPECT_GE(frame.capture_time_ns(), time);
    EXPECT_EQ(frame.sequence(), sequence + 1);
    time = frame.capture_time_ns();
    sequence = frame.sequence();
  }
  EXPECT_GT(static_cast<double>(time) * 1e-9, 5.0 + 3 * session_s * 0.9);
}

TEST(Replay, WhatALiveRunPublishedComesAgainFromItsRecordingT13) {
  const test::TemporaryDirectory folder;
  record_session(folder.path() / "a.rec");
  DaemonOptions live = replaying(folder.path() / "a.rec");
  live.pace = "real-time";
  live.record.emplace((folder.path() / "b.rec").string());
  const Replayed published = run(live, folder.path());
  const DaemonOptions again = replaying(*live.record);
  const Replayed replayed = run(again, folder.path());
  EXPECT_TRUE(published.ended);
  EXPECT_GT(published.frames.size(), 10u);
  EXPECT_EQ(published.frames, replayed.frames);
}

TEST(Replay, ARecordingCutByACrashReplaysAsFarAsItGoes) {
  const test::TemporaryDirectory folder;
  record_session(folder.path() / "a.rec");
  std::filesystem::resize_file(folder.path() / "a.rec",
                               std::filesystem::file_size(folder.path() / "a.rec") / 2);
  const DaemonOptions options = replaying(folder.path() / "a.rec");
  const Replayed replayed = run(options, folder.path());
  EXPECT_TRUE(replayed.ended);
  EXPECT_GT(replayed.frames.size(), 5u);
  EXPECT_FALSE(replayed.error.has_value());
}

TEST(Replay, ADamagedRecordingReplaysUpToTheDamageAndSaysSo) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "a.rec";
  record_session(path);
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(path) / 2));
  file.write("damage", 6);
  file.close();
  const Replayed replayed = run(replaying(path), folder.path());
  EXPECT_TRUE(replayed.ended);
  ASSERT_TRUE(replayed.error.has_value());
  EXPECT_EQ(replayed.error->code, ErrorCode::data_corrupt);
  EXPECT_NE(replayed.error->describe().find("a.rec: at byte"), std::string::npos)
      << replayed.error->describe();
}

TEST(Replay, NoRecordingIsAnErrorThatNamesTheFile) {
  const SystemClock clock;
  const DaemonOptions options = replaying("/does/not/exist.rec");
  SessionControl control;
  control.stop();
  const auto figures = run_daemon(options, clock, quiet, control);
  ASSERT_FALSE(figures.ok());
  EXPECT_NE(figures.error().describe().find("/does/not/exist.rec"), std::string::npos);
}

}  // namespace
}  // namespace handloft::tracking
