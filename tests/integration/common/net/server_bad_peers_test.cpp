// Issue 2: a frame above the limit, an unknown message, a malformed message: that connection gets an error
// and is closed, the others don't notice. A1 of reliability.md: nothing before the hello but 4 KiB and some
// seconds.

#include <optional>

#include "tests/integration/common/net/server_fixture.h"

namespace handloft::net {
namespace {

using testing::HasSubstr;

// Another client's round trip works: nobody else noticed.
void expect_undisturbed(SyncClient& other, std::uint64_t id) {
  v1::Envelope ping;
  ping.mutable_ping()->set_id(id);
  ASSERT_TRUE(other.send(ping).ok());
  const auto answer = other.receive(patience);
  ASSERT_TRUE(answer.ok()) << answer.error().describe();
  EXPECT_EQ(answer->pong().id(), id);
}

v1::Failure failure_and_end(RawPeer& peer) {
  const auto answer = peer.receive();
  EXPECT_TRUE(answer && answer->has_failure());
  if (!answer) return {};
  EXPECT_TRUE(answer->failure().closing());
  EXPECT_FALSE(peer.receive().has_value()) << "closed after the failure";
  return answer->failure();
}

TEST(BadPeers, ADifferentMajorVersionIsRefusedWithBothVersionsNamed) {
  Server server;
  RawPeer peer(server.endpoint());
  peer.send(hello(9));
  const v1::Failure failure = failure_and_end(peer);
  EXPECT_EQ(failure.code(), "unsupported");
  EXPECT_EQ(failure.field(), "hello.protocol_major");
  EXPECT_THAT(failure.message(), HasSubstr("9.0"));
  EXPECT_THAT(failure.message(),
              HasSubstr(std::to_string(protocol_major) + "." + std::to_string(protocol_minor)));
}

TEST(BadPeers, AnOversizedFrameClosesOnlyItsSender) {
  Server server({.options = {.max_frame_bytes = 100'000}});
  SyncClient other = server.connect();
  RawPeer peer(server.endpoint());
  peer.send(hello());
  ASSERT_TRUE(peer.receive()->has_welcome());
  peer.send(std::string("\xA1\x86\x01\x00", 4));  // 100001
  EXPECT_EQ(failure_and_end(peer).code(), "resource_exhausted");
  expect_undisturbed(other, 1);
}

TEST(BadPeers, GarbageAfterTheHelloIsDataCorrupt) {
  Server server;
  SyncClient other = server.connect();
  RawPeer peer(server.endpoint());
  peer.send(hello());
  const std::uint64_t id = peer.receive()->welcome().client_id();
  peer.send(std::string("\x03\x00\x00\x00\xFF\xFF\xFF", 7));
  EXPECT_EQ(failure_and_end(peer).code(), "data_corrupt");
  peer.hang_up();
  EXPECT_THAT(server.close_reason(id), HasSubstr("data_corrupt"));
  expect_undisturbed(other, 2);
}

TEST(BadPeers, AnUnknownMessageIsUnsupported) {
  Server server;
  RawPeer peer(server.endpoint());
  peer.send(hello());
  ASSERT_TRUE(peer.receive()->has_welcome());
  peer.send(std::string("\x03\x00\x00\x00\xA2\x06\x00", 7));  // field 100
  EXPECT_EQ(failure_and_end(peer).code(), "unsupported");
}

TEST(BadPeers, AnErrorOfTheSessionLayerClosesWithItsReason) {
  Server server({.on_message = [](const ConnectionPtr&, const v1::Envelope&) {
    return Status(make_error(ErrorCode::permission_denied, "viewers may not edit", "submit"));
  }});
  RawPeer peer(server.endpoint());
  peer.send(hello());
  ASSERT_TRUE(peer.receive()->has_welcome());
  peer.send(presence("p"));
  const v1::Failure failure = failure_and_end(peer);
  EXPECT_EQ(failure.code(), "permission_denied");
  EXPECT_EQ(failure.message(), "viewers may not edit");
  EXPECT_EQ(failure.field(), "submit");
}

TEST(BadPeers, ACallbackThatThrowsCostsOnlyItsConnection) {
  Server server({.on_message = [](const ConnectionPtr&, const v1::Envelope&) -> Status {
    throw std::runtime_error("broken promise");
  }});
  SyncClient other = server.connect();
  RawPeer peer(server.endpoint());
  peer.send(hello());
  const std::uint64_t id = peer.receive()->welcome().client_id();
  peer.send(presence("p"));
  EXPECT_FALSE(peer.receive().has_value());
  EXPECT_THAT(server.close_reason(id), HasSubstr("broken promise"));
  expect_undisturbed(other, 8);
}

TEST(BadPeers, ARefusedJoinIsNeverAnnounced) {
  Server server({.on_join = [](const ConnectionPtr&) {
    return Status(make_error(ErrorCode::not_found, "no such model", "join.model"));
  }});
  RawPeer peer(server.endpoint());
  peer.send(hello());
  ASSERT_TRUE(peer.receive()->has_welcome());
  EXPECT_EQ(failure_and_end(peer).code(), "not_found");
  peer.hang_up();
  server.wait_until([&] { return (*server).connection_count() == 0; });
}

TEST(BadPeers, BeforeTheHelloFourKilobytesAreTheLimit) {
  Server server;
  RawPeer peer(server.endpoint());
  peer.send(std::string("\x01\x10\x00\x00", 4));  // 4097
  EXPECT_EQ(failure_and_end(peer).code(), "resource_exhausted");
}

TEST(BadPeers, TheFirstMessageMustBeAHello) {
  Server server;
  RawPeer peer(server.endpoint());
  peer.send(presence("too early"));
  const v1::Failure failure = failure_and_end(peer);
  EXPECT_EQ(failure.code(), "failed_precondition");
}

TEST(BadPeers, ASecondHelloAndAHelloWithoutRoleAreRefused) {
  Server server;
  RawPeer twice(server.endpoint());
  twice.send(hello());
  ASSERT_TRUE(twice.receive()->has_welcome());
  twice.send(hello());
  EXPECT_EQ(failure_and_end(twice).code(), "failed_precondition");
  RawPeer without_role(server.endpoint());
  v1::Envelope bare = hello();
  bare.mutable_hello()->clear_role();
  without_role.send(bare);
  EXPECT_EQ(failure_and_end(without_role).field(), "hello.role");
}

// What a name says is logged and shown to others.
TEST(BadPeers, ANameForgesNoLineAndMovesNoCursor) {
  Server server;
  RawPeer peer(server.endpoint());
  v1::Envelope forged = hello();
  forged.mutable_hello()->set_name("Ann\n2026-01-01 info \x1b[31mall is well");
  forged.mutable_hello()->set_program("pen\r\x07 1");
  peer.send(forged);
  const auto welcome = peer.receive();
  ASSERT_TRUE(welcome->has_welcome());
  const ConnectionPtr connection = server.connection(welcome->welcome().client_id());
  EXPECT_EQ(connection->peer().name, "Ann 2026-01-01 info  [31mall is well");
  EXPECT_EQ(connection->peer().program, "pen   1");
}

TEST(BadPeers, AHalfOpenClientIsClosedAfterTheTimeout) {
  Server server({.options = {.hello_timeout = std::chrono::milliseconds(50)}});
  RawPeer silent(server.endpoint());
  EXPECT_EQ(failure_and_end(silent).code(), "timeout");
  RawPeer slow(server.endpoint());
  slow.send(std::string("\x10\x00", 2));  // half a header
  EXPECT_EQ(failure_and_end(slow).code(), "timeout");
  silent.hang_up();
  slow.hang_up();
  server.wait_until([&] { return (*server).connection_count() == 0; });
}

TEST(BadPeers, AClientKilledMidFrameIsForgotten) {
  Server server;
  SyncClient other = server.connect();
  RawPeer peer(server.endpoint());
  peer.send(hello());
  const std::uint64_t id = peer.receive()->welcome().client_id();
  const std::string frame = **encode_frame(presence("cut", 0, 1000));
  peer.send(std::string_view(frame).substr(0, frame.size() / 2));
  peer.hang_up();
  EXPECT_THAT(server.close_reason(id), HasSubstr("in the middle of a frame"));
  expect_undisturbed(other, 3);
}

TEST(BadPeers, MoreThanTheMostConnectionsAreToldSo) {
  Server server({.options = {.max_connections = 2}});
  SyncClient first = server.connect();
  SyncClient second = server.connect();
  RawPeer third(server.endpoint());
  EXPECT_EQ(failure_and_end(third).code(), "resource_exhausted");
  expect_undisturbed(first, 4);
  expect_undisturbed(second, 5);
}

TEST(BadPeers, ManyHalfOpenOnesDoNotKeepOthersOutForLong) {
  Server server({.options = {.hello_timeout = std::chrono::milliseconds(100), .max_half_open = 4}});
  std::vector<std::unique_ptr<RawPeer>> crowd;
  for (int i = 0; i < 20; ++i) crowd.push_back(std::make_unique<RawPeer>(server.endpoint()));
  crowd.clear();
  // They may still be in the kernel's queue, so a first try may be one too many.
  std::optional<SyncClient> client;
  server.wait_until([&] {
    if (client) return true;
    auto tried = SyncClient::connect(server.endpoint(), Server::client_options(), server.clock());
    if (tried) client.emplace(*std::move(tried));
    return client.has_value();
  });
  ASSERT_TRUE(client);
  expect_undisturbed(*client, 6);
}

}  // namespace
}  // namespace handloft::net
