// L2, U4 over real sockets: a client that reads nothing. What the others get must not wait for it, what waits
// for it must stay within its bounds, and when it reads again it gets the newest scene instead of all that
// was. Nothing here depends on how busy the machine is; how much later the others are served is measured by
// bench_session_load --rounds.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "common/net/io_thread.h"
#include "server-model/session/server.h"
#include "tests/integration/server-model/session/session_peers.h"
#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

constexpr int points = 4000;
constexpr std::size_t scene_bytes = std::size_t{14} * points;  ///< Of each change, to each client.
constexpr std::uint64_t changes = 150;

class StalledClient : public ::testing::Test {
 protected:
  void SetUp() override {
    net::Endpoint local;
    local.path = (folder_.path() / "s").string();
    options_.actor.epoch = 1;
    auto server = Server::start(io_.context().get_executor(), {local}, model::Model(), options_, clock_,
                                Logger("server", LogLevel::error));
    ASSERT_TRUE(server.ok()) << server.error().describe();
    server_ = *std::move(server);
  }
  net::Endpoint endpoint() const { return server_->endpoints().front(); }

  net::IoThread io_;
  SystemClock clock_;
  test::TemporaryDirectory folder_;
  ServerOptions options_;
  std::unique_ptr<Server> server_;
};

TEST_F(StalledClient, L2_nobody_waits_for_it_and_nothing_of_the_past_is_kept_for_it) {
  TestPeer editor(endpoint(), v1::ROLE_EDITOR, "editor");
  TestPeer reader(endpoint(), v1::ROLE_VIEWER, "reader");
  TestPeer stalled(endpoint(), v1::ROLE_VIEWER, "stalled");
  for (TestPeer* peer : {&editor, &reader, &stalled}) peer->join();
  v1::Operation operation;
  auto& add = *operation.mutable_add_points();
  add.set_entity("cloud");
  add.mutable_create();
  for (int i = 0; i < points; ++i) add.add_points()->mutable_position()->set_x(1e-4 * i);
  editor.submit(1, operation);
  const auto has_all = [](const TestPeer& peer) {
    const auto found = peer.points.find("cloud");
    return found != peer.points.end() && found->second.positions.size() == points;
  };
  for (TestPeer* peer : {&editor, &reader, &stalled})
    ASSERT_TRUE(peer->read_until([&] { return has_all(*peer); }));

  // From now on it reads nothing, while the whole cloud is moved again and again, and somebody waves.
  std::size_t most_waiting = 0;
  operation.mutable_transform()->add_entities("cloud");
  operation.mutable_transform()->mutable_translation()->set_x(1e-3);
  v1::Envelope wave;
  wave.mutable_presence()->mutable_head()->mutable_world_from_head()->mutable_position()->set_z(0.3);
  for (std::uint64_t change = 2; change <= 1 + changes; ++change) {
    editor.send(wave);
    editor.submit(change, operation);
    ASSERT_TRUE(editor.read_ack(change)) << "the editor waits";
    const std::uint64_t sequence = editor.acks.at(change).sequence();
    ASSERT_TRUE(reader.read_until([&] { return reader.sequence >= sequence; })) << "a reader waits";
    for (const ClientFigures& figures : server_->clients())
      most_waiting = std::max(most_waiting, figures.outbox_bytes);
  }
  EXPECT_EQ(reader.snapshots, 1);
  EXPECT_EQ(server_->viewer_count(), 3U) << "it was not sent away";
  // Not more than is being written and the newest wave; the bounds are some MiB.
  EXPECT_LT(most_waiting, 2 * scene_bytes);
  EXPECT_LT(most_waiting, options_.client_memory.presence_bytes + options_.client_memory.notices_bytes +
                              options_.client_memory.answers_bytes + options_.viewer.max_message_bytes);

  // It reads again: what was in the kernel, and then the newest.
  std::size_t bytes = 0;
  while (stalled.sequence < reader.sequence) {
    auto envelope = stalled.client().receive(patience);
    ASSERT_TRUE(envelope.ok()) << envelope.error().describe();
    bytes += envelope->ByteSizeLong();
    stalled.take(*envelope);
  }
  EXPECT_EQ(stalled.points.at("cloud").positions, reader.points.at("cloud").positions);
  EXPECT_GT(bytes, 0U);
  EXPECT_LT(bytes, changes * scene_bytes / 4)
      << "of " << changes * scene_bytes << " that the others were sent";
}

// Negative control: who reads is sent each change, so that the bytes above tell something.
TEST_F(StalledClient, NegativeControl_who_reads_is_sent_all_of_it) {
  TestPeer editor(endpoint(), v1::ROLE_EDITOR, "editor");
  TestPeer reader(endpoint(), v1::ROLE_VIEWER, "reader");
  reader.join();
  v1::Operation operation;
  operation.mutable_add_points()->set_entity("cloud");
  operation.mutable_add_points()->mutable_create();
  for (int i = 0; i < points; ++i)
    operation.mutable_add_points()->add_points()->mutable_position()->set_x(1e-4 * i);
  editor.submit(1, operation);
  ASSERT_TRUE(editor.read_ack(1));
  operation.mutable_transform()->add_entities("cloud");
  operation.mutable_transform()->mutable_translation()->set_x(1e-3);
  std::size_t bytes = 0;
  constexpr std::uint64_t few = 20;
  for (std::uint64_t change = 2; change <= 1 + few; ++change) {
    editor.submit(change, operation);
    while (reader.sequence < change) {
      auto envelope = reader.client().receive(patience);
      ASSERT_TRUE(envelope.ok()) << envelope.error().describe();
      bytes += envelope->ByteSizeLong();
      reader.take(*envelope);
    }
  }
  EXPECT_GT(bytes, few * scene_bytes / 2);
}

}  // namespace
}  // namespace handloft::session
