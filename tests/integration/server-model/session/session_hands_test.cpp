// Clients that bring hands of their own, over real sockets (V6, U1, U2).

#include <gmock/gmock.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <limits>
#include <memory>
#include <thread>

#include "server-model/session/server.h"
#include "server-model/session/tracking_link.h"
#include "tests/integration/server-model/session/session_peers.h"
#include "tests/support/hand_script.h"
#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

using ::testing::HasSubstr;

/// A client with a hand of numbers, whose clock is its own.
class HandPeer : public TestPeer {
 public:
  HandPeer(const net::Endpoint& endpoint, std::string name, Duration clock_behind = {})
      : TestPeer(endpoint, v1::ROLE_EDITOR, std::move(name)), behind_(clock_behind) {
    join();
  }
  std::uint64_t id() { return client().welcome().client_id(); }
  void show(v1::TrackingFrame frame) {
    frame.set_capture_time_ns(to_ns(clock_.now() - behind_));
    v1::Envelope envelope;
    *envelope.mutable_tracking() = std::move(frame);
    send(envelope);
  }
  void command(std::uint64_t request, const std::string& name) {
    v1::Envelope envelope;
    envelope.mutable_hand_command()->set_request(request);
    envelope.mutable_hand_command()->set_command(name);
    send(envelope);
  }
  test::HandScript script;

 private:
  SystemClock clock_;
  Duration behind_;
};

class HandsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    net::Endpoint local;
    local.path = (folder_.path() / "model.sock").string();
    net::Endpoint tcp;
    tcp.kind = net::Endpoint::Kind::tcp;
    tcp.host = "127.0.0.1";
    auto server = Server::start(context_.get_executor(), {local, tcp}, model::Model(), {}, clock_, log_);
    ASSERT_TRUE(server.ok()) << server.error().describe();
    server_ = *std::move(server);
    io_ = std::thread([this] { context_.run(); });
  }
  void TearDown() override {
    server_.reset();
    work_.reset();
    io_.join();
  }
  net::Endpoint unix_endpoint() const { return server_->endpoints()[0]; }
  net::Endpoint tcp_endpoint() const { return server_->endpoints()[1]; }

  test::TemporaryDirectory folder_;
  SystemClock clock_;
  Logger log_{"test", LogLevel::error};
  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{context_.get_executor()};
  std::unique_ptr<Server> server_;
  std::thread io_;
};

TEST_F(HandsTest, V6_two_clients_with_hands_of_their_own_work_on_two_shapes_at_once) {
  HandPeer ada(unix_endpoint(), "Ada");
  HandPeer bo(tcp_endpoint(), "Bo");
  TestPeer viewer(unix_endpoint(), v1::ROLE_VIEWER, "Cy");
  viewer.join();
  EXPECT_GE(ada.client().welcome().protocol_minor(), 1U);
  EXPECT_NE(ada.id(), bo.id()) << "of two endpoints";
  ada.show(ada.script.laying({0, 0, 0.1}));
  ASSERT_TRUE(ada.read_until([&] { return ada.points["shape-1"].positions.size() == 1; }));
  // Frame by frame, so that the one below counts them.
  for (int i = 1; i < 20; ++i) {
    ada.show(ada.script.laying({0.005 * i, 0, 0.1}));
    bo.show(bo.script.laying({0.005 * i, 0.3, 0.1}));
  }
  ASSERT_TRUE(viewer.read_until([&] {
    return viewer.points["shape-1"].positions.size() == 20 && viewer.points["shape-2"].positions.size() == 19;
  }));
  EXPECT_TRUE(viewer.entities["shape-1"].provisional());
  EXPECT_EQ(viewer.entities["shape-1"].provisional_by(), ada.id());
  EXPECT_EQ(viewer.entities["shape-2"].provisional_by(), bo.id());
  ada.show(ada.script.resting({0, 0, 0.5}));
  bo.show(bo.script.resting({0, 0, 0.5}));
  bo.command(1, "undo");
  ASSERT_TRUE(bo.read_ack(1));
  EXPECT_FALSE(bo.acks[1].has_failure()) << bo.acks[1].failure().message();
  // Each is told of its own hand as well, which has the words of its tool.
  ASSERT_TRUE(bo.read_until([&] { return bo.presence["Bo"].tool() == "undo"; }));
  EXPECT_EQ(bo.presence["Bo"].client_id(), bo.id());
  ASSERT_TRUE(viewer.read_until([&] { return !viewer.entities["shape-1"].provisional(); }));
}

TEST_F(HandsTest, U1_one_that_breaks_off_in_mid_stroke_loses_nothing_and_holds_nobody_up) {
  auto ada = std::make_unique<HandPeer>(unix_endpoint(), "Ada");
  HandPeer bo(tcp_endpoint(), "Bo");
  for (int i = 0; i < 10; ++i) {
    ada->show(ada->script.laying({0.005 * i, 0, 0.1}));
    bo.show(bo.script.laying({0.005 * i, 0.3, 0.1}));
  }
  const auto laid = [&](const char* id) { return bo.points[id].positions.size(); };
  ASSERT_TRUE(bo.read_until([&] { return laid("shape-1") == 10 && laid("shape-2") == 10; }));
  ada.reset();
  ASSERT_TRUE(bo.read_until([&] { return bo.presence["Ada"].gone(); }));
  for (int i = 10; i < 15; ++i) bo.show(bo.script.laying({0.005 * i, 0.3, 0.1}));
  bo.show(bo.script.resting({0, 0, 0.5}));
  bo.command(1, "new_shape");
  ASSERT_TRUE(bo.read_ack(1));
  const ActorState state = server_->actor().state();
  EXPECT_EQ(state.interaction.strokes_committed, 2U);
  std::size_t points = 0;
  for (const auto& [id, entity] : state.document.entities) points += model::as_dual(entity)->points.size();
  EXPECT_EQ(points, 25U);
  EXPECT_EQ(state.client_frames.left_out, 0U);
}

TEST_F(HandsTest, U2_a_viewers_hand_and_a_broken_one_harm_only_themselves) {
  TestPeer viewer(unix_endpoint(), v1::ROLE_VIEWER, "Cy");
  viewer.join();
  test::HandScript script;
  v1::Envelope envelope;
  *envelope.mutable_tracking() = script.laying({0, 0, 0.1});
  for (int i = 0; i < 3; ++i) viewer.send(envelope);
  ASSERT_TRUE(viewer.read_until([&] { return viewer.failure.code() == "permission_denied"; }));
  EXPECT_FALSE(viewer.failure.closing());
  HandPeer eve(unix_endpoint(), "Eve");
  v1::TrackingFrame bad = eve.script.laying({0, 0, 0.1});
  bad.mutable_hands(0)->set_fingertip_positions(0, std::numeric_limits<double>::quiet_NaN());
  eve.show(bad);
  ASSERT_TRUE(eve.read_until([&] { return eve.failure.code() == "invalid_argument"; }));
  EXPECT_EQ(eve.failure.field(), "tracking.hands[0].fingertip_positions[0]");
  EXPECT_EQ(server_->actor().state().document.entities.size(), 0U);
  // Both go on as they may.
  eve.command(7, "symmetry");
  ASSERT_TRUE(eve.read_ack(7));
  EXPECT_FALSE(eve.acks[7].has_failure());
  EXPECT_FALSE(viewer.closed);
}

TEST_F(HandsTest, T4_over_tcp_a_hand_on_another_clock_is_timed_on_the_servers) {
  // The connection's hello is on our clock, so only frames that claim to be far off are seen to be.
  HandPeer ada(tcp_endpoint(), "Ada", std::chrono::seconds(100));
  const TimePoint before = clock_.now();
  ada.show(ada.script.laying({0, 0, 0.1}));
  ASSERT_TRUE(ada.read_until([&] { return ada.presence.contains("Ada"); }));
  EXPECT_GE(ada.presence["Ada"].capture_time_ns(), to_ns(before)) << "older than any network: as it came";
  EXPECT_LE(ada.presence["Ada"].capture_time_ns(), to_ns(clock_.now()));
}

TEST_F(HandsTest, T14_the_servers_own_hand_goes_on_beside_those_of_clients) {
  net::Endpoint endpoint;
  endpoint.path = (folder_.path() / "tracking.sock").string();
  FakeDaemon daemon(context_, endpoint, clock_, log_);
  HandPeer ada(unix_endpoint(), "Ada");
  ada.show(ada.script.laying({0, 0.5, 0.1}));
  ASSERT_TRUE(ada.read_until([&] { return ada.points["shape-1"].positions.size() == 1; }));
  TrackingLink link(endpoint, server_->actor(), clock_, log_);
  ASSERT_TRUE(ada.read_until([&] { return ada.sequence == 5; })) << "its five strokes";
  EXPECT_EQ(ada.entities["shape-1"].provisional_by(), ada.id());
  EXPECT_TRUE(ada.entities["shape-1"].provisional());
  EXPECT_EQ(ada.points["shape-2"].positions.size(), 294U);
  EXPECT_EQ(ada.presence["hand"].client_id(), 0U);
  EXPECT_EQ(server_->actor().state().tracking.gaps, 1U);
}

}  // namespace
}  // namespace handloft::session
