#pragma once
// A server's peers without sockets: who connects is a FakeConnection, and what it says is handled at once.

#include <gmock/gmock.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/session/peers.h"
#include "tests/support/fake_connection.h"
#include "tests/support/hand_script.h"
#include "tests/support/test_data.h"

namespace handloft::session {

using Eigen::Vector3d;
using ::testing::HasSubstr;

class PeersTest : public ::testing::Test {
 protected:
  using ConnectionPtr = std::shared_ptr<test::FakeConnection>;

  void SetUp() override { start({}); }
  void TearDown() override {
    if (peers_) peers_->actor().stop();
  }
  void start(ServerOptions options, model::Model initial = model::Model()) {
    if (peers_) peers_->actor().stop();
    clock_.set(from_ns(1'000'000'000'000));
    options.files.read_folder = folder_.path();
    options.files.write_folder = folder_.path();
    options.actor.export_folder = folder_.path();
    peers_ = Peers::start(std::move(initial), std::move(options), clock_, Logger("test", LogLevel::off));
    events_ = peers_->events(net::Endpoint::Kind::unix_socket);
  }
  ConnectionPtr connect(v1::Role role, const std::string& name) { return connect_as(++last_id_, role, name); }
  /// Of a client with a key, whose id is the same each time.
  ConnectionPtr connect_as(std::uint64_t id, v1::Role role, const std::string& name) {
    net::PeerInfo info;
    info.role = role;
    info.name = name;
    info.protocol_minor = net::protocol_minor;
    auto connection = std::make_shared<test::FakeConnection>(id, info);
    EXPECT_TRUE(events_.on_join(connection).ok());
    return connection;
  }
  ConnectionPtr joined(v1::Role role, const std::string& name) {
    auto connection = connect(role, name);
    join(connection, {});
    return connection;
  }
  void join(const ConnectionPtr& connection, v1::Join message) {
    v1::Envelope envelope;
    *envelope.mutable_join() = std::move(message);
    EXPECT_TRUE(say(connection, envelope).ok());
    (void)settled();
  }
  std::uint64_t submit(const ConnectionPtr& connection, const v1::Operation& operation,
                       v1::SaveLevel answer_when = v1::SAVE_LEVEL_UNSPECIFIED) {
    v1::Envelope envelope;
    envelope.mutable_submit()->set_request(++last_request_);
    envelope.mutable_submit()->set_answer_when(answer_when);
    *envelope.mutable_submit()->mutable_operation() = operation;
    EXPECT_TRUE(say(connection, envelope).ok());
    return last_request_;
  }
  v1::QueryResult ask(const ConnectionPtr& connection, const v1::Query& query) {
    v1::Envelope envelope;
    envelope.mutable_ask()->set_request(++last_request_);
    *envelope.mutable_ask()->mutable_query() = query;
    EXPECT_TRUE(say(connection, envelope).ok());
    (void)settled();
    for (const v1::Envelope& sent : connection->sent()) {
      if (sent.has_answer() && sent.answer().request() == last_request_) return sent.answer().result();
    }
    ADD_FAILURE() << "no answer";
    return {};
  }
  Status say(const ConnectionPtr& connection, const v1::Envelope& envelope) {
    return events_.on_message(connection, envelope);
  }
  /// A frame of a hand, a frame's time after the one before.
  void show(const ConnectionPtr& connection, v1::TrackingFrame frame) {
    clock_.advance(Duration(test::HandScript::frame_ns));
    frame.set_capture_time_ns(to_ns(clock_.now()));
    send_frame(connection, frame);
  }
  void send_frame(const ConnectionPtr& connection, const v1::TrackingFrame& frame) {
    v1::Envelope envelope;
    *envelope.mutable_tracking() = frame;
    EXPECT_TRUE(say(connection, envelope).ok());
  }
  std::uint64_t command(const ConnectionPtr& connection, const std::string& name, std::uint32_t hand = 0) {
    v1::Envelope envelope;
    envelope.mutable_hand_command()->set_request(++last_request_);
    envelope.mutable_hand_command()->set_hand(hand);
    envelope.mutable_hand_command()->set_command(name);
    EXPECT_TRUE(say(connection, envelope).ok());
    return last_request_;
  }
  void leave(const ConnectionPtr& connection) { events_.on_closed(connection, "as it likes"); }
  /// When all that was said has been done.
  ActorState settled() {
    ActorState state = peers_->actor().state();
    while (!peers_->actor().idle()) state = peers_->actor().state();
    return state;
  }
  /// Settles first. An Ack that never came is a failure of the test.
  v1::Ack ack(const ConnectionPtr& connection, std::uint64_t request) {
    (void)settled();
    for (const v1::Envelope& envelope : connection->sent()) {
      if (envelope.has_ack() && envelope.ack().request() == request) return envelope.ack();
    }
    ADD_FAILURE() << "no answer to " << request;
    return {};
  }
  std::vector<v1::Failure> failures(const ConnectionPtr& connection) {
    (void)settled();
    std::vector<v1::Failure> result;
    for (const v1::Envelope& envelope : connection->sent()) {
      if (envelope.has_failure()) result.push_back(envelope.failure());
    }
    return result;
  }
  /// What it was told last of each hand, by client and name.
  std::map<std::pair<std::uint64_t, std::string>, v1::Presence> presence(const ConnectionPtr& connection) {
    (void)settled();
    std::map<std::pair<std::uint64_t, std::string>, v1::Presence> result;
    for (const v1::Envelope& envelope : connection->sent()) {
      if (!envelope.has_presence()) continue;
      result[{envelope.presence().client_id(), envelope.presence().name()}] = envelope.presence();
    }
    return result;
  }
  /// An entity as it was told last.
  v1::EntityState seen(const ConnectionPtr& connection, const std::string& id) {
    (void)settled();
    v1::EntityState result;
    const auto take = [&](const v1::EntityState& state) {
      if (state.id() != id) return;
      v1::EntityState before = std::exchange(result, state);
      if (!state.has_points()) *result.mutable_points() = before.points();
      if (!state.icons_shown()) *result.mutable_icons() = before.icons();
    };
    for (const v1::Envelope& envelope : connection->sent()) {
      for (const auto& state : envelope.snapshot().entities()) take(state);
      for (const auto& state : envelope.delta().changed()) take(state);
    }
    return result;
  }
  static std::size_t points_of(const ActorState& state, const std::string& id) {
    const model::DualPtr shape = state.document.find_dual(id);
    return shape ? shape->points.size() : 0;
  }

  test::TemporaryDirectory folder_;
  ManualClock clock_;
  test::HandScript script_;
  std::shared_ptr<Peers> peers_;
  net::ServerEvents events_;
  std::uint64_t last_id_ = 0;
  std::uint64_t last_request_ = 0;
};

}  // namespace handloft::session
