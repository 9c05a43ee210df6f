// MessageClient: own thread, reconnecting, refusals in the server's own words.

#include "tests/integration/common/net/server_fixture.h"

namespace handloft::net {
namespace {

using testing::HasSubstr;

// What a client's callbacks saw.
class Seen {
 public:
  ClientEvents events() {
    ClientEvents events;
    events.on_connected = [this](const v1::Welcome&, const ClockOffset&) { change([&] { ++connected; }); };
    events.on_message = [this](v1::Envelope& message) {
      v1::Envelope mine = std::move(message);
      change([&] { names.push_back(mine.presence().name()); });
    };
    events.on_disconnected = [this](const Error& error) { change([&] { errors.push_back(error); }); };
    return events;
  }
  template <typename Condition>
  void wait(Condition condition) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, patience, condition));
  }

  int connected = 0;
  std::vector<std::string> names;
  std::vector<Error> errors;

 private:
  template <typename Change>
  void change(Change how) {
    const std::lock_guard lock(mutex_);
    how();
    changed_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable changed_;
};

const Logger quiet("test", LogLevel::off);

TEST(Client, MessagesGoBothWays) {
  Server server({.on_message = [](const ConnectionPtr& connection, const v1::Envelope& message) {
    connection->send(message);
    return Status();
  }});
  Seen seen;
  auto client = MessageClient::connect(server.endpoint(), Server::client_options(), seen.events(),
                                       server.clock(), quiet);
  ASSERT_TRUE(client.ok()) << client.error().describe();
  EXPECT_EQ(seen.connected, 1) << "before connect() returns";
  EXPECT_NE((*client)->client_id(), 0u);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE((*client)->send(presence("echo " + std::to_string(i))).ok());
  seen.wait([&] { return seen.names.size() == 100; });
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(seen.names[static_cast<std::size_t>(i)], "echo " + std::to_string(i));
  EXPECT_EQ((*client)->frames_received(), 100u);
}

TEST(Client, EndsAtOnceAmidAHandshakeWithAMuteServer) {
  test::TemporaryDirectory folder;
  const auto endpoint = parse_endpoint("unix:" + (folder.path() / "mute.sock").string());
  ASSERT_TRUE(endpoint.ok());
  auto listener = listen_on(*endpoint, TcpExposure::loopback_only);
  ASSERT_TRUE(listener.ok()) << listener.error().describe();
  ClientOptions options = Server::client_options();
  options.handshake_timeout = 10 * patience;
  const SystemClock clock;
  auto client = MessageClient::start(*endpoint, options, {}, clock, quiet);
  pollfd waiting{listener->fd.get(), POLLIN, 0};
  ASSERT_EQ(poll(&waiting, 1, -1), 1);
  const FileDescriptor accepted(accept(listener->fd.get(), nullptr, nullptr));
  char first = 0;
  ASSERT_EQ(recv(accepted.get(), &first, 1, 0), 1) << "the greeting is on its way";
  const auto before = std::chrono::steady_clock::now();
  client.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - before, patience);
  close_listener(*listener);
}

TEST(Client, WhatTheSocketDoesNotTakeIsSentLater) {
  std::mutex gate;
  std::unique_lock closed(gate);
  Server server({.on_message = [&](const ConnectionPtr&, const v1::Envelope&) {
    const std::lock_guard wait(gate);
    return Status();
  }});
  Seen seen;
  ClientOptions options = Server::client_options();
  options.max_queued_bytes = 4u << 20;
  auto client = MessageClient::connect(server.endpoint(), options, seen.events(), server.clock(), quiet);
  int sent = 0;
  while ((*client)->send(presence("x", 0, 100'000)).ok()) ++sent;
  EXPECT_EQ((*client)->send(presence("x", 0, 100'000)).error().code, ErrorCode::resource_exhausted);
  EXPECT_GE(sent, 40);
  closed.unlock();
  server.wait_for_messages(sent);
}

TEST(Client, ARefusalComesInTheServersWordsAndIsNotTriedAgain) {
  const test::TemporaryDirectory folder;
  const SystemClock clock;
  const auto endpoint = parse_endpoint("unix:" + (folder.path() / "s").string());
  auto listener = listen_on(*endpoint);
  std::thread newer_server([&] {
    pollfd readable{listener->fd.get(), POLLIN, 0};
    poll(&readable, 1, static_cast<int>(patience.count()));
    const FileDescriptor peer(accept(listener->fd.get(), nullptr, nullptr));
    v1::Envelope refusal;
    refusal.mutable_failure()->set_code("unsupported");
    refusal.mutable_failure()->set_message("found protocol version 1.0, this program speaks 9.3");
    refusal.mutable_failure()->set_closing(true);
    const std::string bytes = **encode_frame(refusal);
    static_cast<void>(!send(peer.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL));
    char sink[4096];
    while (recv(peer.get(), sink, sizeof(sink), 0) > 0) {
    }
  });
  auto client = MessageClient::connect(*endpoint, Server::client_options(), {}, clock, quiet);
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error().code, ErrorCode::unsupported);
  EXPECT_THAT(client.error().message, HasSubstr("1.0, this program speaks 9.3"));
  newer_server.join();
}

TEST(Client, AFullServersReasonReachesTheCaller) {
  Server server({.options = {.max_connections = 1}});
  SyncClient first = server.connect();
  Seen seen;
  auto client = MessageClient::connect(server.endpoint(), Server::client_options(), seen.events(),
                                       server.clock(), quiet);
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error().code, ErrorCode::resource_exhausted);
}

TEST(Client, NobodyThereIsNotFoundAfterTheTimeout) {
  const test::TemporaryDirectory folder;
  const SystemClock clock;
  ClientOptions options = Server::client_options();
  options.connect_timeout = std::chrono::milliseconds(50);
  const auto endpoint = parse_endpoint("unix:" + (folder.path() / "none").string());
  auto client = MessageClient::connect(*endpoint, options, {}, clock, quiet);
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error().code, ErrorCode::not_found);
}

TEST(Client, AMuteServerIsATimeout) {
  const test::TemporaryDirectory folder;
  const SystemClock clock;
  const auto endpoint = parse_endpoint("unix:" + (folder.path() / "mute").string());
  auto listener = listen_on(*endpoint);
  ClientOptions options = Server::client_options();
  options.connect_timeout = std::chrono::milliseconds(50);
  options.handshake_timeout = std::chrono::milliseconds(50);
  auto client = SyncClient::connect(*endpoint, options, clock);
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error().code, ErrorCode::timeout);
}

TEST(Client, ConnectsWheneverTheServerComesAndComesBack) {
  const test::TemporaryDirectory folder;
  const std::string where = "unix:" + (folder.path() / "s").string();
  const SystemClock clock;
  Seen seen;
  auto client =
      MessageClient::start(*parse_endpoint(where), Server::client_options(), seen.events(), clock, quiet);
  EXPECT_EQ(client->send(presence("early")).error().code, ErrorCode::failed_precondition);
  {
    Server server({.endpoint = where});
    seen.wait([&] { return seen.connected == 1; });
  }
  seen.wait([&] { return seen.errors.size() == 1; });
  Server again({.endpoint = where});
  seen.wait([&] { return seen.connected == 2; });
  EXPECT_TRUE(client->connected());
}

TEST(Client, EndsWhileNobodyAnswers) {
  const test::TemporaryDirectory folder;
  const SystemClock clock;
  Seen seen;
  ClientOptions options = Server::client_options();
  options.retry_interval = std::chrono::hours(1);
  MessageClient::start(*parse_endpoint("unix:" + (folder.path() / "s").string()), options, seen.events(),
                       clock, quiet)
      .reset();
  EXPECT_EQ(seen.connected, 0);
}

TEST(Client, AServersMalformedFrameEndsTheConnection) {
  const test::TemporaryDirectory folder;
  const SystemClock clock;
  const auto endpoint = parse_endpoint("unix:" + (folder.path() / "s").string());
  auto listener = listen_on(*endpoint);
  std::thread server([&] {
    pollfd readable{listener->fd.get(), POLLIN, 0};
    poll(&readable, 1, static_cast<int>(patience.count()));
    const FileDescriptor peer(accept(listener->fd.get(), nullptr, nullptr));
    v1::Envelope welcome;
    welcome.mutable_welcome()->set_protocol_major(protocol_major);
    const std::string bytes = **encode_frame(welcome) + std::string("\xFF\xFF\xFF\xFF", 4);
    static_cast<void>(!send(peer.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL));
    char sink[4096];
    while (recv(peer.get(), sink, sizeof(sink), 0) > 0) {
    }
  });
  Seen seen;
  auto client = MessageClient::connect(*endpoint, Server::client_options(), seen.events(), clock, quiet);
  ASSERT_TRUE(client.ok()) << client.error().describe();
  seen.wait([&] { return seen.errors.size() == 1; });
  EXPECT_EQ(seen.errors[0].code, ErrorCode::resource_exhausted);
  server.join();
}

}  // namespace
}  // namespace handloft::net
