// Many sources in one live session: none of them can end it, who comes and goes is told at once (T3), and
// devices are published even when no camera delivers (T14).

#include "daemon-tracking/main/live_session.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "common/net/io_thread.h"
#include "common/net/message_client.h"
#include "daemon-tracking/source/glove_report.h"
#include "proto/session.pb.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;
constexpr std::chrono::milliseconds patience{10000};
const Logger quiet("test", LogLevel::off);

// Says what the test tells it to.
class ScriptedSource final : public SampleSource {
 public:
  explicit ScriptedSource(std::string name, Status starting = {})
      : name_(std::move(name)), starting_(std::move(starting)) {}
  const std::string& name() const override { return name_; }
  Status start(SampleSink sink) override {
    if (!starting_) return starting_;
    sink_ = std::move(sink);
    started_.set_value();
    return {};
  }
  void stop() override { stopped_ = true; }
  bool finished() const override { return false; }
  void say(Sample sample) {
    if (!waited_) started_.get_future().wait();
    waited_ = true;
    sink_(std::move(sample));
  }
  bool stopped() const { return stopped_; }

 private:
  std::string name_;
  Status starting_;
  SampleSink sink_;
  std::promise<void> started_;
  bool waited_ = false;
  std::atomic<bool> stopped_{false};
};

class LiveSessionTest : public testing::Test {
 protected:
  LiveSessionTest() {
    Rig rig = default_rig();
    auto publisher = Publisher::listen(io_.context().get_executor(),
                                       *net::parse_endpoint("unix:" + (folder_.path() / "t.sock").string()),
                                       clock_, quiet);
    EXPECT_TRUE(publisher.ok());
    publisher_ = std::move(*publisher);
    auto pipeline = TrackingPipeline::create(rig);
    EXPECT_TRUE(pipeline.ok());
    std::vector<CameraTracker> trackers;
    for (std::uint32_t i = 0; i < rig.cameras.size(); ++i)
      trackers.push_back(std::move(*CameraTracker::create(rig, i)));
    session_ = std::make_unique<LiveSession>(std::vector<SampleSource*>{&broken_, &glove_, &camera_},
                                             std::move(trackers), clock_, quiet, nullptr);
    StageParts parts;
    parts.metrics = &board_;
    stage_ = std::make_unique<FusionStage>(std::move(*pipeline), *publisher_, clock_, TimeLine::present,
                                           quiet, std::move(parts));
    net::ClientOptions options;
    options.role = v1::ROLE_SUBSCRIBER;
    auto client = net::SyncClient::connect(publisher_->endpoint(), options, clock_);
    EXPECT_TRUE(client.ok()) << client.error().describe();
    client_.emplace(std::move(*client));
    v1::Envelope subscribe;
    subscribe.mutable_subscribe()->set_delivery(v1::Subscribe::EVERY);
    EXPECT_TRUE(client_->send(subscribe).ok());
    EXPECT_TRUE(publisher_->wait_for_subscribers(1, patience));
    running_ = std::async(std::launch::async,
                          [this] { return session_->run(*stage_, control_, [] { return true; }); });
  }
  ~LiveSessionTest() override {
    control_.stop();
    if (running_.valid()) {
      EXPECT_EQ(running_.get(), SessionControl::Wake::stop);
    }
    client_.reset();
    publisher_->stop();
    io_.finish();  // Its last callbacks come before the publisher goes.
  }

  v1::TrackingFrame next_frame() {
    auto message = client_->receive(patience);
    EXPECT_TRUE(message.ok()) << message.error().describe();
    return message.ok() ? std::move(*message->mutable_tracking()) : v1::TrackingFrame();
  }
  // The first frame for which `wanted` holds; fails after many.
  template <typename Wanted>
  v1::TrackingFrame frame_with(Wanted wanted) {
    for (int i = 0; i < 1000; ++i) {
      v1::TrackingFrame frame = next_frame();
      if (testing::Test::HasFailure() || wanted(frame)) return frame;
    }
    ADD_FAILURE() << "no such frame came";
    return {};
  }
  static const v1::DeviceHealth* health(const v1::TrackingFrame& frame, const std::string& device) {
    for (const v1::DeviceHealth& each : frame.devices())
      if (each.device() == device) return &each;
    return nullptr;
  }
  GloveBytes report(std::uint16_t sequence, std::uint16_t force) const {
    GloveReport fields;
    fields.sequence = sequence;
    fields.device_time_us = sequence * 4000U;
    fields.force = force;
    const auto bytes = encode_glove_report(fields);
    return {clock_.now(), {bytes.begin(), bytes.end()}};
  }

  const SystemClock clock_;
  test::TemporaryDirectory folder_;
  net::IoThread io_;
  MetricsBoard board_;
  SessionControl control_;
  ScriptedSource broken_{"pen", make_error(ErrorCode::io, "it is on fire", "pen")};
  ScriptedSource glove_{"glove"};
  ScriptedSource camera_{"camera/left"};
  std::unique_ptr<Publisher> publisher_;
  std::unique_ptr<LiveSession> session_;
  std::unique_ptr<FusionStage> stage_;
  std::optional<net::SyncClient> client_;
  std::future<SessionControl::Wake> running_;
};

TEST_F(LiveSessionTest, WhoComesAndGoesIsToldWithin100msWithoutAnyCameraT3) {
  Duration longest{};
  for (int i = 0; i < 20; ++i) {
    const bool present = i % 2 == 0;
    const TimePoint began = clock_.now();
    glove_.say(DevicePresence{began, "glove", present});
    frame_with([&](const v1::TrackingFrame& frame) {
      const v1::DeviceHealth* glove = health(frame, "glove");
      return glove != nullptr && glove->present() == present;
    });
    longest = std::max(longest, clock_.now() - began);
  }
  EXPECT_LT(longest, 100ms);
  RecordProperty("longest_ms", std::to_string(to_seconds(longest) * 1000.0));
}

TEST_F(LiveSessionTest, AGloveIsPublishedWhileNoCameraDeliversT14) {
  for (std::uint16_t i = 0; i < 200; ++i) glove_.say(report(i, 900));
  const v1::TrackingFrame frame = frame_with([](const v1::TrackingFrame& each) {
    return each.hands_size() > 0 && each.hands(0).glove_present() && each.hands(0).pressure_raw() == 900;
  });
  EXPECT_TRUE(frame.hands(0).pressing());
}

TEST_F(LiveSessionTest, SilenceIsToldTooAndTimeNeverGoesBack) {
  glove_.say(DevicePresence{clock_.now(), "glove", true});
  std::int64_t last = 0;
  std::uint64_t sequence = 0;
  for (int i = 0; i < 5; ++i) {  // One for the glove, the others for the silence.
    const v1::TrackingFrame frame = next_frame();
    EXPECT_GE(frame.capture_time_ns(), last);
    EXPECT_GT(frame.sequence(), sequence);
    last = frame.capture_time_ns();
    sequence = frame.sequence();
  }
}

TEST_F(LiveSessionTest, LostReportsOfTheGloveAreCountedAndAreAnAlarmT12) {
  glove_.say(DevicePresence{clock_.now(), "glove", true});
  std::uint16_t sequence = 0;
  v1::TrackingFrame frame;
  // Every second report is lost, until somebody complains.
  const TimePoint until = clock_.now() + 5s;
  std::string problem;
  while (problem.empty() && clock_.now() < until && !HasFailure()) {
    sequence = static_cast<std::uint16_t>(sequence + 2);
    glove_.say(report(sequence, 0));
    frame = next_frame();
    if (const v1::DeviceHealth* glove = health(frame, "glove")) problem = glove->problem();
  }
  EXPECT_NE(problem.find("were lost or unreadable"), std::string::npos) << problem;
  EXPECT_GT(health(frame, "glove")->dropped(), 0u);
}

TEST_F(LiveSessionTest, ReportsThatNobodyCanReadAreCounted) {
  glove_.say(DevicePresence{clock_.now(), "glove", true});
  for (int i = 0; i < 5; ++i) glove_.say(GloveBytes{clock_.now(), {1, 2, 3}});
  glove_.say(DevicePresence{clock_.now(), "glove", false});
  const v1::TrackingFrame frame = frame_with([&](const v1::TrackingFrame& each) {
    const v1::DeviceHealth* glove = health(each, "glove");
    return glove != nullptr && glove->refused() == 5;
  });
  EXPECT_EQ(health(frame, "glove")->refused(), 5u);
}

TEST_F(LiveSessionTest, EverySourceIsStoppedInTheEndAlsoAfterOneFailed) {
  glove_.say(DevicePresence{clock_.now(), "glove", true});
  next_frame();
  control_.stop();
  EXPECT_EQ(running_.get(), SessionControl::Wake::stop);
  EXPECT_TRUE(broken_.stopped());
  EXPECT_TRUE(glove_.stopped());
  EXPECT_TRUE(camera_.stopped());
}

}  // namespace
}  // namespace handloft::tracking
