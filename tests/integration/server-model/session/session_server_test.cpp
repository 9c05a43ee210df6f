// The model server over real sockets: several clients, one scene; refusals by name; peers that misbehave harm
// only themselves.

#include <gmock/gmock.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <thread>

#include "common/codec/point_codec.h"
#include "server-model/session/remote_target.h"
#include "server-model/session/report.h"
#include "server-model/session/script_runner.h"
#include "server-model/session/server.h"
#include "server-model/session/tracking_link.h"
#include "tests/integration/server-model/session/session_peers.h"
#include "tests/support/hand_script.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

v1::Operation create(const std::string& id) {
  v1::Operation operation;
  operation.mutable_create_dual_shape()->set_id(id);
  return operation;
}

v1::Operation add_points(const std::string& id, int count) {
  v1::Operation operation;
  operation.mutable_add_points()->set_entity(id);
  for (int i = 0; i < count; ++i) {
    v1::Point& point = *operation.mutable_add_points()->add_points();
    const double x = 0.001 * (i % 50);
    const double y = 0.002 * (i / 50);
    point.mutable_position()->set_x(x);
    point.mutable_position()->set_y(y);
    point.mutable_position()->set_z(0.1 + x * x - y);
    point.set_pressure(0.5);
  }
  return operation;
}

class SessionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("handloft-session-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    start({});
  }
  void TearDown() override {
    server_.reset();
    work_.reset();
    io_.join();
    std::filesystem::remove_all(folder_);
  }
  void start(ServerOptions options) {
    net::Endpoint local;
    local.path = (folder_ / "model.sock").string();
    net::Endpoint tcp;
    tcp.kind = net::Endpoint::Kind::tcp;
    tcp.host = "127.0.0.1";
    options.files.read_folder = folder_;
    options.files.write_folder = folder_;
    auto server = Server::start(context_.get_executor(), {local, tcp}, model::Model(), std::move(options),
                                clock_, log_);
    ASSERT_TRUE(server.ok()) << server.error().describe();
    server_ = *std::move(server);
    io_ = std::thread([this] { context_.run(); });
  }
  net::Endpoint unix_endpoint() const { return server_->endpoints()[0]; }
  net::Endpoint tcp_endpoint() const { return server_->endpoints()[1]; }

  std::filesystem::path folder_;
  SystemClock clock_;
  Logger log_{"test", LogLevel::error};
  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{context_.get_executor()};
  std::unique_ptr<Server> server_;
  std::thread io_;
};

TEST_F(SessionTest, two_clients_see_the_same_scene) {
  TestPeer editor(unix_endpoint(), v1::ROLE_EDITOR, "editor");
  TestPeer viewer(tcp_endpoint(), v1::ROLE_VIEWER, "viewer");
  viewer.join();
  editor.join();
  editor.submit(1, create("top"));
  editor.submit(2, add_points("top", 400));
  v1::Operation fit;
  fit.mutable_fit()->set_entity("top");
  editor.submit(3, fit);
  ASSERT_TRUE(editor.read_ack(3));
  EXPECT_EQ(editor.acks[1].sequence(), 1U);
  EXPECT_EQ(editor.acks[3].sequence(), 3U);
  EXPECT_THAT(editor.acks[3].entities(), ::testing::ElementsAre("top"));
  const auto complete = [](const TestPeer& peer) {
    return peer.sequence == 3 && peer.entities.at("top").has_surface();
  };
  ASSERT_TRUE(viewer.read_until([&] { return complete(viewer); }));
  ASSERT_TRUE(editor.read_until([&] { return complete(editor); }));
  TestPeer late(unix_endpoint(), v1::ROLE_VIEWER, "late");
  late.join();
  ASSERT_TRUE(late.read_until([&] { return complete(late); }));
  EXPECT_EQ(viewer.snapshots, 1);
  for (TestPeer* peer : {&viewer, &editor, &late}) {
    EXPECT_EQ(peer->points.at("top").positions.size(), 400U);
    EXPECT_TRUE(peer->entities.at("top").SerializeAsString() ==
                viewer.entities.at("top").SerializeAsString());
  }
}

TEST_F(SessionTest, a_refused_operation_is_answered_by_code_and_field_and_changes_nothing) {
  TestPeer editor(unix_endpoint(), v1::ROLE_EDITOR, "editor");
  editor.submit(1, create("top"));
  v1::Operation bad = add_points("top", 3);
  bad.mutable_add_points()->mutable_points(1)->mutable_position()->set_x(
      std::numeric_limits<double>::quiet_NaN());
  editor.submit(2, bad);
  editor.submit(3, create("top"));
  editor.submit(4, v1::Operation());
  ASSERT_TRUE(editor.read_ack(4));
  EXPECT_FALSE(editor.acks[1].has_failure());
  EXPECT_EQ(editor.acks[2].failure().code(), "invalid_argument");
  EXPECT_THAT(editor.acks[2].failure().field(), HasSubstr("points[1].position.x"));
  EXPECT_EQ(editor.acks[3].failure().code(), "already_exists");
  EXPECT_EQ(editor.acks[4].failure().code(), "invalid_argument");
  EXPECT_EQ(server_->actor().state().sequence, 1U);
}

TEST_F(SessionTest, H3_an_operation_sent_twice_applies_once) {
  TestPeer editor(unix_endpoint(), v1::ROLE_EDITOR, "editor");
  editor.submit(1, create("top"));
  v1::Operation once = add_points("top", 5);
  once.set_client_op_id(77);
  editor.submit(2, once);
  editor.submit(3, once);
  ASSERT_TRUE(editor.read_ack(3));
  EXPECT_EQ(editor.acks[2].sequence(), editor.acks[3].sequence());
  EXPECT_EQ(server_->actor().state().document.find_dual("top")->points.size(), 5U);
}

TEST_F(SessionTest, a_viewer_may_not_change_anything_and_a_subscriber_may_not_come_in) {
  TestPeer viewer(unix_endpoint(), v1::ROLE_VIEWER, "viewer");
  viewer.submit(1, create("top"));
  ASSERT_TRUE(viewer.read_ack(1));
  EXPECT_EQ(viewer.acks[1].failure().code(), "permission_denied");
  // Refused instead of welcomed.
  net::ClientOptions options;
  options.role = v1::ROLE_SUBSCRIBER;
  options.connect_timeout = 5s;
  const auto subscriber = net::SyncClient::connect(unix_endpoint(), options, clock_);
  ASSERT_FALSE(subscriber.ok());
  EXPECT_EQ(subscriber.error().code, ErrorCode::permission_denied);
  EXPECT_EQ(subscriber.error().field, "hello.role");
  EXPECT_EQ(subscriber.error().message,
            "found ROLE_SUBSCRIBER, expected ROLE_VIEWER or ROLE_COMMENTER or ROLE_EDITOR or ROLE_OWNER");
}

TEST_F(SessionTest, tcp_peers_stay_in_their_folder) {
  TestPeer editor(tcp_endpoint(), v1::ROLE_EDITOR, "remote");
  v1::Operation fetch;
  fetch.mutable_import_strokes()->set_path("/etc/hostname");
  fetch.mutable_import_strokes()->set_entity("top");
  editor.submit(1, create("top"));
  editor.submit(2, fetch);
  ASSERT_TRUE(editor.read_ack(2));
  EXPECT_EQ(editor.acks[2].failure().code(), "permission_denied");
}

TEST_F(SessionTest, F1_hostile_and_dying_clients_do_not_disturb_the_others) {
  TestPeer editor(unix_endpoint(), v1::ROLE_EDITOR, "editor");
  editor.join();
  std::uint64_t request = 0;
  const auto still_works = [&] {
    ++request;
    editor.submit(request, create("shape-x" + std::to_string(request)));
    ASSERT_TRUE(editor.read_ack(request));
    EXPECT_FALSE(editor.acks[request].has_failure());
  };
  {
    TestPeer garbage(unix_endpoint(), v1::ROLE_EDITOR, "garbage");
    ASSERT_TRUE(garbage.client().send_bytes(std::string("\x05\x00\x00\x00\xff\xff\xff\xff\xff", 9)).ok());
    EXPECT_FALSE(garbage.read_until([] { return false; }));
    EXPECT_TRUE(garbage.closed);
    EXPECT_EQ(garbage.failure.code(), "data_corrupt");
    EXPECT_TRUE(garbage.failure.closing());
  }
  still_works();
  {
    TestPeer huge(unix_endpoint(), v1::ROLE_EDITOR, "huge");
    ASSERT_TRUE(huge.client().send_bytes("\xff\xff\xff\x7f").ok());
    EXPECT_FALSE(huge.read_until([] { return false; }));
    EXPECT_EQ(huge.failure.code(), "resource_exhausted");
  }
  still_works();
  {
    TestPeer dying(tcp_endpoint(), v1::ROLE_EDITOR, "dying");
    dying.join();
    ASSERT_TRUE(dying.client().send_bytes(std::string("\x00\x10\x00\x00\x0a", 5)).ok());  // then it is killed
  }
  still_works();
  {
    TestPeer confused(unix_endpoint(), v1::ROLE_EDITOR, "confused");
    v1::Envelope wrong;
    wrong.mutable_ack();
    confused.send(wrong);
    EXPECT_FALSE(confused.read_until([] { return false; }));
    EXPECT_EQ(confused.failure.code(), "invalid_argument");
    EXPECT_EQ(
        confused.failure.message(),
        "found the message \"ack\", expected join, submit, ask, presence, tracking, hand_command or lease");
  }
  still_works();
}

TEST_F(SessionTest, L2_a_stalled_viewer_hurts_nobody_and_catches_up_with_the_newest) {
  TestPeer stalled(unix_endpoint(), v1::ROLE_VIEWER, "stalled");
  stalled.join();
  TestPeer editor(unix_endpoint(), v1::ROLE_EDITOR, "editor");
  editor.submit(1, create("top"));
  constexpr int strokes = 60;
  for (int i = 0; i < strokes; ++i) {
    editor.submit(static_cast<std::uint64_t>(i + 2), add_points("top", 1000));
    ASSERT_TRUE(editor.read_ack(static_cast<std::uint64_t>(i + 2)));  // never waits for the stalled one
  }
  ASSERT_TRUE(stalled.read_until([&] { return stalled.sequence == strokes + 1; }));
  EXPECT_EQ(stalled.points.at("top").positions.size(), strokes * 1000U);
}

TEST_F(SessionTest, presence_goes_to_the_others_cleaned_and_ends_with_the_connection) {
  TestPeer viewer(unix_endpoint(), v1::ROLE_VIEWER, "viewer");
  viewer.join();
  ASSERT_TRUE(viewer.read_until([&] { return viewer.snapshots == 1; }));
  {
    TestPeer editor(tcp_endpoint(), v1::ROLE_EDITOR, "anna");
    v1::Envelope envelope;
    envelope.mutable_presence()->set_name("somebody else");
    envelope.mutable_presence()->set_tool("fit");
    envelope.mutable_presence()->mutable_head()->mutable_world_from_head()->mutable_position()->set_x(
        std::numeric_limits<double>::quiet_NaN());
    editor.send(envelope);
    ASSERT_TRUE(viewer.read_until([&] { return viewer.presence.contains("anna"); }));
    EXPECT_EQ(viewer.presence["anna"].tool(), "fit");
    EXPECT_EQ(viewer.presence["anna"].head().state(), v1::TRACKING_LOST);
    EXPECT_FALSE(viewer.presence.contains("somebody else"));
  }
  EXPECT_TRUE(viewer.read_until([&] { return viewer.presence["anna"].gone(); }));
}

TEST_F(SessionTest, the_hand_reaches_the_viewers_with_its_capture_time) {
  TestPeer viewer(unix_endpoint(), v1::ROLE_VIEWER, "viewer");
  viewer.join();
  ASSERT_TRUE(viewer.read_until([&] { return viewer.snapshots == 1; }));
  test::HandScript script;
  std::int64_t last = 0;
  for (int i = 0; i < 25; ++i) {
    v1::TrackingFrame frame = script.laying({0.001 * i, 0.0, 0.1});
    last = frame.capture_time_ns();
    server_->actor().push_frame(std::move(frame));
  }
  ASSERT_TRUE(viewer.read_until([&] { return viewer.capture_time_ns == last; }));
  EXPECT_TRUE(viewer.entities.at("shape-1").provisional());
  EXPECT_EQ(viewer.points.at("shape-1").positions.size(), 25U);
  EXPECT_TRUE(viewer.read_until([&] { return viewer.presence["hand"].tool() == "laying points"; }));
  server_->actor().push_frame(script.resting());
  ASSERT_TRUE(viewer.read_until([&] { return viewer.sequence == 1; }));
  EXPECT_FALSE(viewer.entities.at("shape-1").provisional());
  EXPECT_TRUE(viewer.entities.at("shape-1").selected());
  EXPECT_GT(server_->capture_to_delta().count, 0U);
}

TEST_F(SessionTest, every_frame_of_a_recording_arrives_and_gaps_are_counted) {
  net::Endpoint endpoint;
  endpoint.path = (folder_ / "tracking.sock").string();
  // The link is there first: the daemon may come later.
  TrackingLink link(endpoint, server_->actor(), clock_, log_);
  const FakeDaemon daemon(context_, endpoint, clock_, log_);
  TestPeer viewer(unix_endpoint(), v1::ROLE_VIEWER, "viewer");
  viewer.join();
  ASSERT_TRUE(viewer.read_until([&] { return viewer.sequence == 5; }));
  const ActorState state = server_->actor().state();
  EXPECT_EQ(state.tracking.frames, 299U);
  EXPECT_EQ(state.tracking.gaps, 1U);
  EXPECT_EQ(state.document.find_dual("shape-1")->points.size(), 294U);
  EXPECT_EQ(state.document.find_dual("shape-1")->stroke_count, 5U);
  server_->stop();
  const std::string report = report_json({state, server_->clients_served(), server_->capture_to_delta()});
  EXPECT_THAT(report, HasSubstr("\"hash\": \"" + state.hash + "\""));
  EXPECT_THAT(report, HasSubstr("\"point_count\": 294"));
  EXPECT_THAT(report, HasSubstr("\"gaps\": 1"));
}

TEST_F(SessionTest, D19_the_daemon_is_told_what_the_glove_should_let_the_hand_feel) {
  TestPeer editor(unix_endpoint(), v1::ROLE_EDITOR, "editor");
  v1::Operation sheet;
  sheet.mutable_create_sculpt_surface()->set_id("sheet");
  sheet.mutable_create_sculpt_surface()->mutable_rectangle()->set_width_m(0.4);
  sheet.mutable_create_sculpt_surface()->mutable_rectangle()->set_depth_m(0.3);
  editor.submit(1, sheet);
  v1::Operation icon;
  icon.mutable_add_icon()->set_entity("sheet");
  icon.mutable_add_icon()->add_places();
  editor.submit(2, icon);
  ASSERT_TRUE(editor.read_ack(2));
  ASSERT_FALSE(editor.acks[2].has_failure()) << editor.acks[2].failure().message();
  test::HandScript script;
  std::vector<v1::TrackingFrame> frames{script.resting({0, 0, 0.02})};
  for (int i = 0; i < 10; ++i) frames.push_back(script.closed({0, 0, 0.02 + 0.002 * i}));
  frames.push_back(script.resting({0, 0, 0.3}));
  net::Endpoint endpoint;
  endpoint.path = (folder_ / "tracking.sock").string();
  FakeDaemon daemon(context_, endpoint, clock_, log_, std::move(frames));
  const TrackingLink link(endpoint, server_->actor(), clock_, log_);
  const std::vector<v1::GloveFeedback> told = daemon.feedback(2);
  ASSERT_EQ(told.size(), 2U) << "picked and let go";
  for (const v1::GloveFeedback& each : told) {
    EXPECT_GT(each.vibration(), 0.0);
    EXPECT_LE(each.vibration(), 0.5);
    EXPECT_GT(each.vibration_ms(), 0U);
    EXPECT_LE(each.vibration_ms(), 60U);
  }
}

TEST_F(SessionTest, U7_a_script_drives_a_running_server) {
  auto target = RemoteTarget::connect(unix_endpoint(), clock_);
  ASSERT_TRUE(target.ok()) << target.error().describe();
  const auto created = target->submit(create("top"));
  ASSERT_TRUE(created.ok());
  EXPECT_THAT(created->entities, ::testing::ElementsAre("top"));
  ASSERT_TRUE(target->submit(add_points("top", 300)).ok());
  const auto refused = target->submit(add_points("nowhere", 3));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::not_found);
  EXPECT_THAT(refused.error().field, HasSubstr("entity"));
  v1::Operation fit;
  fit.mutable_fit()->set_entity("top");
  ASSERT_TRUE(target->submit(fit).ok());
  v1::Query query;
  query.mutable_hash();
  const auto hash = target->query(query);
  ASSERT_TRUE(hash.ok());
  EXPECT_EQ(hash->hash().sha256(), server_->actor().state().hash);
  v1::Operation save;
  save.mutable_export_()->set_path("top.obj");
  const auto saved = target->submit(save);
  ASSERT_TRUE(saved.ok()) << saved.error().describe();
  EXPECT_TRUE(std::filesystem::exists(folder_ / "top.obj"));
}

TEST_F(SessionTest, all_requests_that_are_sent_ahead_are_applied_in_order) {
  TestPeer ahead(unix_endpoint(), v1::ROLE_EDITOR, "ahead");
  ahead.submit(1, create("top"));
  constexpr std::uint64_t count = 2000;  // of 64 at a time
  for (std::uint64_t i = 2; i <= count; ++i) ahead.submit(i, add_points("top", 5));
  ASSERT_TRUE(ahead.read_until([&] { return ahead.acks.size() == count; }));
  for (const auto& [request, ack] : ahead.acks) {
    EXPECT_FALSE(ack.has_failure()) << request << ack.failure().message();
    EXPECT_EQ(ack.sequence(), request);
  }
}

// The limits at work: with one request or byte at a time every further one waits, and none is lost; the other
// client is served meanwhile.
class PipelineTest : public SessionTest,
                     public ::testing::WithParamInterface<std::pair<std::size_t, std::size_t>> {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("handloft-pipeline-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    ServerOptions options;
    options.max_pending_requests = GetParam().first;
    options.max_pending_bytes = GetParam().second;
    start(std::move(options));
  }
};

TEST_P(PipelineTest, no_request_is_lost_at_the_limit) {
  TestPeer ahead(unix_endpoint(), v1::ROLE_EDITOR, "ahead");
  TestPeer other(tcp_endpoint(), v1::ROLE_EDITOR, "other");
  constexpr std::uint64_t count = 300;
  for (std::uint64_t i = 1; i <= count; ++i) {
    ahead.submit(i, create("a" + std::to_string(i)));
    if (i % 50 != 0) continue;
    other.submit(i, create("b" + std::to_string(i)));
    ASSERT_TRUE(other.read_ack(i));
  }
  ASSERT_TRUE(ahead.read_until([&] { return ahead.acks.size() == count; }));
  for (const auto& [request, ack] : ahead.acks) EXPECT_FALSE(ack.has_failure()) << request;
  EXPECT_EQ(server_->actor().state().sequence, count + count / 50);
}

INSTANTIATE_TEST_SUITE_P(Limits, PipelineTest,
                         ::testing::Values(std::pair{1U, 1U << 20}, std::pair{2U, 1U << 20},
                                           std::pair{1000U, 1U}, std::pair{1000U, 100U}));

TEST_F(SessionTest, operations_and_questions_need_no_join_and_bring_no_scene) {
  TestPeer editor(unix_endpoint(), v1::ROLE_EDITOR, "editor");
  editor.submit(1, create("top"));
  ASSERT_TRUE(editor.read_ack(1));
  EXPECT_EQ(editor.acks[1].sequence(), 1U);
  v1::Envelope question;
  question.mutable_ask()->set_request(2);
  question.mutable_ask()->mutable_query()->mutable_entities();
  editor.send(question);
  const auto answer = editor.client().receive(5000ms);
  ASSERT_TRUE(answer.ok()) << answer.error().describe();
  EXPECT_EQ(answer->answer().result().entities().entities(0).id(), "top");
  EXPECT_EQ(editor.snapshots, 0);
}

}  // namespace
}  // namespace handloft::session
