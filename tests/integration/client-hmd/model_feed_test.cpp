// The feeds against a server on a real socket: joining, deltas, nonsense, a server that goes and comes back.

#include "client-hmd/mirror/model_feed.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "client-hmd/view/tracking_feed.h"
#include "common/net/message_server.h"
#include "tests/support/eventually.h"
#include "tests/support/test_data.h"
#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A server that answers each Join with a snapshot and sends what the test wants.
class FakeServer {
 public:
  explicit FakeServer(const net::Endpoint& endpoint) : work_(boost::asio::make_work_guard(context_)) {
    net::ServerEvents events;
    events.on_join = [this](const net::ConnectionPtr& connection) -> Status {
      const std::lock_guard lock(mutex_);
      connection_ = connection;
      return {};
    };
    events.on_message = [this](const net::ConnectionPtr& connection, const v1::Envelope& envelope) -> Status {
      const std::lock_guard lock(mutex_);
      if (envelope.has_join()) {
        v1::Envelope answer;
        *answer.mutable_snapshot() = test::snapshot();
        connection->send(answer);
        ++joins_;
      }
      if (envelope.has_subscribe()) ++subscribes_;
      changed_.notify_all();
      return {};
    };
    Result<std::unique_ptr<net::MessageServer>> server = net::MessageServer::listen(
        context_.get_executor(), endpoint, {}, events, clock_, Logger("fake", LogLevel::off));
    EXPECT_TRUE(server.ok()) << server.error().describe();
    if (server.ok()) server_ = std::move(*server);
    thread_ = std::thread([this] { context_.run(); });
  }
  ~FakeServer() {
    server_.reset();
    work_.reset();
    context_.stop();
    thread_.join();
  }
  void send(const v1::Envelope& envelope) {
    const std::lock_guard lock(mutex_);
    ASSERT_NE(connection_, nullptr);
    connection_->send(envelope);
  }
  bool wait_for_joins(int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, seconds(10), [&] { return joins_ >= count; });
  }
  bool wait_for_subscribe() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, seconds(10), [&] { return subscribes_ > 0; });
  }

 private:
  SystemClock clock_;
  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  std::unique_ptr<net::MessageServer> server_;
  std::mutex mutex_;
  std::condition_variable changed_;
  net::ConnectionPtr connection_;
  int joins_ = 0;
  int subscribes_ = 0;
  std::thread thread_;
};

using handloft::test::eventually;  // The frame loop polls the feed in the same way.

class Feeds : public testing::Test {
 protected:
  net::Endpoint endpoint() const {
    return *net::parse_endpoint("unix:" + (folder_.path() / "s.sock").string());
  }
  std::unique_ptr<ModelFeed> start() {
    return ModelFeed::start(endpoint(), clock_, Logger("feed", LogLevel::off));
  }
  std::size_t points(const ModelFeed& feed) const {
    const std::shared_ptr<const ModelState> state = feed.state();
    const auto found = state->scene->entities.find("top");
    return found == state->scene->entities.end() ? 0 : found->second->points->points.size();
  }

  handloft::test::TemporaryDirectory folder_;
  SystemClock clock_;
};

TEST_F(Feeds, JoinReceiveASnapshotThenDeltas) {
  FakeServer server(endpoint());
  const std::unique_ptr<ModelFeed> feed = start();
  ASSERT_TRUE(eventually([&] { return points(*feed) == 3; }));
  EXPECT_TRUE(feed->state()->connected);

  v1::Envelope envelope;
  *envelope.mutable_delta() = test::delta();
  envelope.mutable_delta()->set_capture_time_ns(to_ns(clock_.now() - milliseconds(20)));
  *envelope.mutable_delta()->mutable_changed(0)->mutable_points() = test::cloud(3, 4);
  server.send(envelope);
  ASSERT_TRUE(eventually([&] { return points(*feed) == 7; }));
  const ModelFeedStatistics statistics = feed->statistics();
  EXPECT_EQ(statistics.capture_to_receipt.count(), 1U);
  EXPECT_GE(statistics.capture_to_receipt.quantile_ms(0.5), 20.0);
  EXPECT_TRUE(feed->state()->has_capture_time);
}

TEST_F(Feeds, RefuseNonsenseKeepThePictureAndJoinAgain) {
  FakeServer server(endpoint());
  ManualClock clock(from_ns(1'000'000'000));
  const std::unique_ptr<ModelFeed> feed = ModelFeed::start(endpoint(), clock, Logger("feed", LogLevel::off));
  ASSERT_TRUE(eventually([&] { return points(*feed) == 3; }));
  clock.advance(seconds(2));  // Soon after joining, a feed does not ask again.
  v1::Envelope envelope;
  *envelope.mutable_delta() = test::delta();
  *envelope.mutable_delta()->mutable_changed(0)->mutable_points() = test::cloud(500, 1);
  server.send(envelope);
  ASSERT_TRUE(server.wait_for_joins(2));
  ASSERT_TRUE(eventually([&] { return feed->state()->snapshots == 2; }));
  EXPECT_EQ(feed->statistics().mirror.refused, 1U);
  EXPECT_EQ(points(*feed), 3U);
  EXPECT_TRUE(feed->state()->connected);
}

TEST_F(Feeds, StartBeforeTheServerAndSurviveItsRestart_V5) {
  const std::unique_ptr<ModelFeed> feed = start();
  EXPECT_FALSE(feed->state()->connected) << "returns at once";
  EXPECT_EQ(feed->state()->scene->entities.size(), 0U);
  {
    FakeServer server(endpoint());
    ASSERT_TRUE(eventually([&] { return points(*feed) == 3; }));
  }
  ASSERT_TRUE(eventually([&] { return !feed->state()->connected; }));
  EXPECT_EQ(points(*feed), 3U) << "the last picture stays";
  FakeServer again(endpoint());
  ASSERT_TRUE(again.wait_for_joins(1));
  ASSERT_TRUE(eventually([&] { return feed->state()->connected && feed->state()->snapshots == 2; }));
  EXPECT_EQ(feed->statistics().connects, 2U);
}

TEST_F(Feeds, PresenceSaysWhatTheHandDoes) {
  FakeServer server(endpoint());
  const std::unique_ptr<ModelFeed> feed = start();
  ASSERT_TRUE(eventually([&] { return points(*feed) == 3; }));
  v1::Envelope envelope;
  envelope.mutable_presence()->set_client_id(4);
  envelope.mutable_presence()->set_tool("laying points");
  envelope.mutable_presence()->set_symmetry(true);
  server.send(envelope);
  ASSERT_TRUE(eventually([&] { return feed->state()->activities.size() == 1; }));
  EXPECT_EQ(feed->state()->activities.at({4, ""}).tool, "laying points");
  envelope.mutable_presence()->set_gone(true);
  server.send(envelope);
  ASSERT_TRUE(eventually([&] { return feed->state()->activities.empty(); }));
}

TEST_F(Feeds, TrackingSubscribesAndAnswers) {
  FakeServer server(endpoint());
  const std::unique_ptr<TrackingFeed> feed =
      TrackingFeed::start(endpoint(), clock_, Logger("feed", LogLevel::off));
  ASSERT_TRUE(server.wait_for_subscribe());
  const TimePoint now = clock_.now();
  v1::Envelope envelope;
  v1::TrackingFrame& frame = *envelope.mutable_tracking();
  frame.set_capture_time_ns(to_ns(now));
  frame.mutable_head()->set_state(v1::TRACKING_TRACKED);
  frame.mutable_head()->mutable_world_from_head()->mutable_position()->set_z(0.4);
  frame.mutable_head()->mutable_world_from_head()->mutable_orientation()->set_w(1.0);
  server.send(envelope);
  ASSERT_TRUE(eventually([&] { return feed->head_at(now).has_value(); }));
  EXPECT_DOUBLE_EQ(feed->head_at(now)->pose.position.z, 0.4);
  EXPECT_EQ(feed->status().frames, 1U);
}

}  // namespace
}  // namespace handloft::client
