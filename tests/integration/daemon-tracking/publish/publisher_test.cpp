// Subscribers of every kind on real sockets (T14): the newest for the slow, everything for replays, nobody
// waits.

#include "daemon-tracking/publish/publisher.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <future>
#include <limits>
#include <thread>
#include <vector>

#include "common/net/message_client.h"
#include "proto/session.pb.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds patience{10000};

class PublisherTest : public testing::Test {
 protected:
  PublisherTest() {
    const auto endpoint = net::parse_endpoint("unix:" + (folder_.path() / "t.sock").string());
    auto publisher = Publisher::listen(io_.get_executor(), *endpoint, clock_, Logger("test", LogLevel::off));
    EXPECT_TRUE(publisher.ok()) << publisher.error().describe();
    publisher_ = std::move(*publisher);
  }
  ~PublisherTest() override {
    publisher_->stop();
    work_.reset();
    io_.stop();
    thread_.join();
  }

  net::SyncClient connect() {
    net::ClientOptions options;
    options.role = v1::ROLE_SUBSCRIBER;
    options.program = "test";
    auto client = net::SyncClient::connect(publisher_->endpoint(), options, clock_);
    EXPECT_TRUE(client.ok()) << client.error().describe();
    return std::move(*client);
  }
  net::SyncClient subscribe(v1::Subscribe::Delivery delivery) {
    const std::size_t before = publisher_->subscriber_count();
    net::SyncClient client = connect();
    v1::Envelope envelope;
    envelope.mutable_subscribe()->set_delivery(delivery);
    EXPECT_TRUE(client.send(envelope).ok());
    EXPECT_TRUE(publisher_->wait_for_subscribers(before + 1, patience));
    return client;
  }
  void publish(std::uint64_t sequence, std::size_t padding = 0) {
    v1::TrackingFrame frame;
    frame.set_sequence(sequence);
    frame.add_devices()->set_problem(std::string(padding, 'x'));
    publisher_->publish(frame);
    EXPECT_EQ(frame.sequence(), sequence) << "the caller's message is given back for reuse";
  }

  test::TemporaryDirectory folder_;
  SystemClock clock_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{io_.get_executor()};
  std::thread thread_{[this] { io_.run(); }};
  std::unique_ptr<Publisher> publisher_;
};

TEST_F(PublisherTest, NothingComesBeforeASubscription) {
  net::SyncClient silent = connect();
  net::SyncClient subscriber = subscribe(v1::Subscribe::LATEST);
  publish(1);
  EXPECT_EQ(subscriber.receive(patience)->tracking().sequence(), 1u);
  v1::Envelope ping;
  ping.mutable_ping()->set_id(7);
  ASSERT_TRUE(silent.send(ping).ok());
  EXPECT_TRUE(silent.receive(patience)->has_pong()) << "the first thing it hears is its own pong";
}

TEST_F(PublisherTest, FramesCarryTheirPublishTime) {
  net::SyncClient subscriber = subscribe(v1::Subscribe::LATEST);
  const std::int64_t before = to_ns(clock_.now());
  publish(1);
  const auto message = subscriber.receive(patience);
  EXPECT_GE(message->tracking().publish_time_ns(), before);
  EXPECT_LE(message->tracking().publish_time_ns(), to_ns(clock_.now()));
}

TEST_F(PublisherTest, WhoComesLateGetsTheLastFrameAtOnceMadeWhole) {
  publish(1);
  v1::TrackingFrame whole;
  whole.set_sequence(2);
  whole.add_cameras()->set_width_px(640);
  for (std::uint32_t i = 0; i < 5; ++i) whole.add_fingertip_colours(i);
  publisher_->publish(whole);
  v1::TrackingFrame last;
  last.set_sequence(3);
  last.add_cameras()->set_exposure_time_ns(77);
  last.set_end_of_recording(true);
  publisher_->publish(last);
  net::SyncClient first = subscribe(v1::Subscribe::LATEST);
  net::SyncClient second = subscribe(v1::Subscribe::EVERY);
  for (net::SyncClient* late : {&first, &second}) {
    const auto message = late->receive(patience);
    ASSERT_TRUE(message.ok()) << message.error().describe();
    const v1::TrackingFrame& frame = message->tracking();
    EXPECT_EQ(frame.sequence(), 3u);
    EXPECT_TRUE(frame.end_of_recording());
    ASSERT_EQ(frame.cameras_size(), 1);
    EXPECT_EQ(frame.cameras(0).width_px(), 640u) << "the lens of an earlier frame";
    EXPECT_EQ(frame.cameras(0).exposure_time_ns(), 77);
    EXPECT_EQ(frame.fingertip_colours_size(), 5);
  }
}

TEST_F(PublisherTest, SubscribingAgainBringsNoOldFrame) {
  publish(1);
  net::SyncClient client = subscribe(v1::Subscribe::LATEST);
  EXPECT_EQ(client.receive(patience)->tracking().sequence(), 1u);
  v1::Envelope envelope;
  envelope.mutable_subscribe()->set_delivery(v1::Subscribe::EVERY);
  ASSERT_TRUE(client.send(envelope).ok());
  v1::Envelope ping;
  ping.mutable_ping()->set_id(7);
  ASSERT_TRUE(client.send(ping).ok());
  EXPECT_TRUE(client.receive(patience)->has_pong());
}

TEST_F(PublisherTest, ASlowSubscriberGetsTheNewestWhileOthersGetAll) {
  net::SyncClient slow = subscribe(v1::Subscribe::LATEST);
  net::SyncClient quick = subscribe(v1::Subscribe::LATEST);
  constexpr std::uint64_t count = 1000;
  for (std::uint64_t i = 1; i <= count; ++i) {
    publish(i, 4000);
    ASSERT_EQ(quick.receive(patience)->tracking().sequence(), i);
  }
  EXPECT_GT(publisher_->frames_missed(), 0u);
  std::uint64_t last = 0, received = 0;
  while (last < count) {
    const auto message = slow.receive(patience);
    ASSERT_TRUE(message.ok()) << message.error().describe();
    ASSERT_GT(message->tracking().sequence(), last);
    last = message->tracking().sequence();
    ++received;
  }
  EXPECT_LT(received, count);
  EXPECT_EQ(received + publisher_->frames_missed(), count) << "each frame was sent or counted as missed";
}

TEST_F(PublisherTest, AReplayWaitsForWhoWantsEveryFrame) {
  net::SyncClient every = subscribe(v1::Subscribe::EVERY);
  constexpr std::uint64_t count = 1000;
  std::thread replay([&] {
    for (std::uint64_t i = 1; i <= count; ++i) {
      publish(i, 4000);
      publisher_->wait_for_readers(patience);
    }
  });
  for (std::uint64_t i = 1; i <= count; ++i) {
    const auto message = every.receive(patience);
    ASSERT_TRUE(message.ok()) << message.error().describe();
    ASSERT_EQ(message->tracking().sequence(), i);
  }
  replay.join();
  EXPECT_TRUE(publisher_->drain(patience));
}

TEST_F(PublisherTest, WhoNeverReadsDoesNotHoldUpAReplayForEver) {
  net::SyncClient stuck = subscribe(v1::Subscribe::EVERY);
  std::uint64_t published = 0;
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (publisher_->subscriber_count() > 0 && std::chrono::steady_clock::now() < deadline) {
    publish(++published, 4000);
    publisher_->wait_for_readers(5ms);
  }
  EXPECT_EQ(publisher_->subscriber_count(), 0u) << "closed";
}

TEST_F(PublisherTest, ALiveSourceNeverWaitsForASubscriberThatIsStuck) {
  net::SyncClient stuck = subscribe(v1::Subscribe::EVERY);
  net::SyncClient quick = subscribe(v1::Subscribe::LATEST);
  for (std::uint64_t i = 1; i <= 6000; ++i) {
    publish(i, 4000);
    ASSERT_EQ(quick.receive(patience)->tracking().sequence(), i);
  }
  EXPECT_GT(publisher_->frames_missed(), 0u) << "what is kept for it is bounded";
}

TEST_F(PublisherTest, OtherMessagesAreRefused) {
  net::SyncClient client = connect();
  v1::Envelope envelope;
  envelope.mutable_join();
  ASSERT_TRUE(client.send(envelope).ok());
  const auto answer = client.receive(patience);
  ASSERT_TRUE(answer.ok() && answer->has_failure());
  EXPECT_EQ(answer->failure().code(), "unsupported");
}

v1::Envelope feedback(std::uint32_t rgb, double vibration, std::uint32_t ms) {
  v1::Envelope envelope;
  envelope.mutable_glove_feedback()->set_led_rgb(rgb);
  envelope.mutable_glove_feedback()->set_vibration(vibration);
  envelope.mutable_glove_feedback()->set_vibration_ms(ms);
  return envelope;
}

TEST_F(PublisherTest, FeedbackForTheGloveIsHandedOnT9) {
  std::promise<v1::GloveFeedback> came;
  publisher_->on_glove_feedback([&](const v1::GloveFeedback& message) { came.set_value(message); });
  net::SyncClient client = subscribe(v1::Subscribe::LATEST);
  ASSERT_TRUE(client.send(feedback(0x102030, 0.5, 200)).ok());
  auto future = came.get_future();
  ASSERT_EQ(future.wait_for(patience), std::future_status::ready);
  const v1::GloveFeedback message = future.get();
  EXPECT_EQ(message.led_rgb(), 0x102030u);
  EXPECT_EQ(message.vibration(), 0.5);
  EXPECT_EQ(message.vibration_ms(), 200u);
  publisher_->on_glove_feedback({});
}

TEST_F(PublisherTest, FeedbackThatIsNoneIsRefusedByNameT9) {
  const std::vector<std::pair<v1::Envelope, std::string>> bad{
      {feedback(0x1000000, 0, 0), "glove_feedback.led_rgb"},
      {feedback(0, 1.01, 0), "glove_feedback.vibration"},
      {feedback(0, -0.1, 0), "glove_feedback.vibration"},
      {feedback(0, std::numeric_limits<double>::quiet_NaN(), 0), "glove_feedback.vibration"},
      {feedback(0, 0, 1001), "glove_feedback.vibration_ms"}};
  for (const auto& [envelope, field] : bad) {
    net::SyncClient client = connect();
    v1::Envelope first;
    first.mutable_subscribe();
    ASSERT_TRUE(client.send(first).ok());
    ASSERT_TRUE(client.send(envelope).ok());
    const auto answer = client.receive(patience);
    ASSERT_TRUE(answer.ok() && answer->has_failure());
    EXPECT_EQ(answer->failure().code(), "invalid_argument");
    EXPECT_EQ(answer->failure().field(), field);
  }
  net::SyncClient stranger = connect();
  ASSERT_TRUE(stranger.send(feedback(0, 0, 0)).ok());
  const auto answer = stranger.receive(patience);
  ASSERT_TRUE(answer.ok() && answer->has_failure());
  EXPECT_EQ(answer->failure().code(), "failed_precondition");
}

TEST_F(PublisherTest, AFloodOfFeedbackIsThinnedOutT9) {
  std::atomic<int> came{0};
  publisher_->on_glove_feedback([&](const v1::GloveFeedback&) { ++came; });
  net::SyncClient client = subscribe(v1::Subscribe::LATEST);
  const auto begin = std::chrono::steady_clock::now();
  constexpr int sent = 2000;
  for (int i = 0; i < sent; ++i) ASSERT_TRUE(client.send(feedback(0, 0, 0)).ok());
  v1::Envelope ping;
  ping.mutable_ping()->set_id(1);
  ASSERT_TRUE(client.send(ping).ok());
  ASSERT_TRUE(client.receive(patience)->has_pong()) << "all before it was handled";
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_LE(came.load(), Publisher::feedback_burst + seconds * Publisher::feedback_rate_hz + 1);
  EXPECT_GE(came.load(), static_cast<int>(Publisher::feedback_burst));
  EXPECT_EQ(publisher_->feedback_dropped() + static_cast<std::uint64_t>(came.load()), sent);
  publisher_->on_glove_feedback({});
}

TEST_F(PublisherTest, WaitingForSubscribersEndsAtItsTimeout) {
  EXPECT_TRUE(publisher_->wait_for_subscribers(0, 0ms));
  EXPECT_FALSE(publisher_->wait_for_subscribers(1, 1ms));
}

}  // namespace
}  // namespace handloft::tracking
