// A slow receiver gets the newest and costs bounded memory; the others and the producer are not slowed (idea
// 5, L2).

#include "tests/integration/common/net/server_fixture.h"

namespace handloft::net {
namespace {

Frame frame_of(const v1::Envelope& envelope) {
  return *encode_frame(envelope);
}

TEST(Delivery, WelcomeCarriesTheHandshake) {
  Server server({.options = {.program = "served 1", .max_frame_bytes = 12345}});
  SyncClient client = server.connect("Ada");
  EXPECT_EQ(client.welcome().program(), "served 1");
  EXPECT_EQ(client.welcome().max_frame_bytes(), 12345u);
  EXPECT_EQ(client.welcome().protocol_major(), protocol_major);
  // One host, one clock: the offset is within the round trip.
  EXPECT_GE(client.clock_offset().round_trip.count(), 0);
  EXPECT_LE(std::abs(client.clock_offset().server_minus_client.count()),
            client.clock_offset().round_trip.count());
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  EXPECT_EQ(connection->peer().name, "Ada");
  EXPECT_EQ(connection->peer().role, v1::ROLE_EDITOR);
}

TEST(Delivery, WorksOverTcpWithAPortOfTheSystemsChoice) {
  Server server({.endpoint = "tcp:127.0.0.1:0"});
  EXPECT_NE(server.endpoint().port, 0);
  SyncClient client = server.connect();
  ASSERT_TRUE(server.connection(client.welcome().client_id())->send(presence("hi")));
  EXPECT_EQ(client.receive(patience)->presence().name(), "hi");
}

TEST(Delivery, AFrameLargerThanEverySocketBufferArrivesWhole) {
  Server server;
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  ASSERT_TRUE(connection->send(presence("large", 1, 5u << 20)));
  ASSERT_TRUE(connection->send(presence("after")));
  const auto large = client.receive(patience);
  ASSERT_TRUE(large.ok()) << large.error().describe();
  EXPECT_EQ(large->presence().tool().size(), 5u << 20);
  EXPECT_EQ(client.receive(patience)->presence().name(), "after");
}

TEST(Delivery, ASlowSubscriberGetsTheNewestAndTheOthersGetAll) {
  Server server({.options = {.send_buffer_bytes = 4096}});
  SyncClient slow = server.connect("slow");
  SyncClient quick = server.connect("quick");
  const ConnectionPtr to_slow = server.connection(slow.welcome().client_id());
  const ConnectionPtr to_quick = server.connection(quick.welcome().client_id());
  constexpr std::int64_t count = 2000;
  for (std::int64_t i = 1; i <= count; ++i) {
    const Frame frame = frame_of(presence("state", i, 1000));
    ASSERT_TRUE(to_slow->send_latest({1, "state"}, frame));
    ASSERT_TRUE(to_quick->send_latest({1, "state"}, frame));
    ASSERT_EQ(quick.receive(patience)->presence().capture_time_ns(), i);
  }
  EXPECT_LE(to_slow->statistics().queued_frames, 2u) << "one slot, and one frame half written";
  EXPECT_GT(to_slow->statistics().replaced, 1000u);
  std::int64_t last = 0, received = 0;
  while (last < count) {
    const auto message = slow.receive(patience);
    ASSERT_TRUE(message.ok()) << message.error().describe();
    ASSERT_GT(message->presence().capture_time_ns(), last);
    last = message->presence().capture_time_ns();
    ++received;
  }
  EXPECT_LT(received, count / 2);
}

std::string next_name(SyncClient& client) {
  const auto message = client.receive(patience);
  return message ? message->presence().name() : message.error().describe();
}

TEST(Delivery, StatesThatComeCloseTogetherGoTogether_L1) {
  using namespace std::chrono_literals;
  Server server({.options = {.states_apart = 1h}});
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  const std::uint64_t writes = connection->statistics().writes, frames = connection->statistics().frames_sent;
  ASSERT_TRUE(connection->send_latest({1, "a"}, frame_of(presence("a"))));
  EXPECT_EQ(next_name(client), "a") << "the first goes at once";
  for (const char* name : {"a", "b", "c"}) {
    ASSERT_TRUE(connection->send_latest({1, name}, frame_of(presence(name))));
    ASSERT_TRUE(connection->send_latest({1, name}, frame_of(presence(std::string(name) + " again"))));
  }
  EXPECT_EQ(connection->statistics().queued_frames, 3u);
  EXPECT_EQ(connection->statistics().replaced, 3u);
  EXPECT_EQ(connection->statistics().writes, writes + 1);
  // What is no state does not wait for them, and takes them along.
  ASSERT_TRUE(connection->send(presence("an answer")));
  for (const char* name : {"an answer", "a again", "b again", "c again"}) EXPECT_EQ(next_name(client), name);
  EXPECT_EQ(connection->statistics().writes, writes + 3);
  EXPECT_EQ(connection->statistics().frames_sent, frames + 5);
  // So does a notice, and what is pulled.
  ASSERT_TRUE(connection->send_latest({1, "a"}, frame_of(presence("a once more"))));
  ASSERT_TRUE(connection->send_latest({2, "", Lane::notices}, frame_of(presence("a notice"))));
  EXPECT_EQ(next_name(client), "a once more");
  EXPECT_EQ(next_name(client), "a notice");
  ASSERT_TRUE(connection->send_latest({1, "a"}, frame_of(presence("a at last"))));
  connection->notify_pull();
  EXPECT_EQ(next_name(client), "a at last");
}

TEST(Delivery, StatesThatWaitGoWhenTheirTimeHasCome_L1) {
  using namespace std::chrono_literals;
  Server server({.options = {.states_apart = 20ms}});
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  for (int round = 0; round < 3; ++round) {
    const std::string now = std::to_string(round);
    ASSERT_TRUE(connection->send_latest({1, "first"}, frame_of(presence("first " + now))));
    ASSERT_TRUE(connection->send_latest({1, "then"}, frame_of(presence("then " + now))));
    EXPECT_EQ(next_name(client), "first " + now);
    EXPECT_EQ(next_name(client), "then " + now);
  }
}

TEST(Delivery, AnEndDoesNotWaitForStates) {
  using namespace std::chrono_literals;
  Server server({.options = {.states_apart = 1h}});
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  for (const char* name : {"a", "b"})
    ASSERT_TRUE(connection->send_latest({1, name}, frame_of(presence(name))));
  connection->close();
  EXPECT_EQ(next_name(client), "a");
  EXPECT_EQ(next_name(client), "b") << "what waits is still sent";
  EXPECT_FALSE(client.receive(patience).ok());
  server.close_reason(connection->id());
}

TEST(Delivery, APulledMessageIsComposedWhenThereIsRoomForIt) {
  // Before the server, whose thread may still be composing when the test is over.
  std::atomic<std::int64_t> state{0}, told{0}, asked{0};
  Server server({.options = {.send_buffer_bytes = 4096}});
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  connection->set_pull([&]() -> std::optional<Frame> {
    ++asked;
    const std::int64_t now = state.load();
    if (told.exchange(now) == now) return std::nullopt;
    return frame_of(presence("pulled", now, 1000));
  });
  constexpr std::int64_t count = 2000;
  for (std::int64_t i = 1; i <= count; ++i) {
    state = i;
    connection->notify_pull();
  }
  EXPECT_LT(told.load(), count) << "nobody reads, so nothing new was composed";
  std::int64_t last = 0, received = 0;
  while (last < count) {
    const auto message = client.receive(patience);
    ASSERT_TRUE(message.ok()) << message.error().describe();
    last = message->presence().capture_time_ns();
    ++received;
  }
  EXPECT_EQ(last, count);
  EXPECT_LT(received, count / 2);
  connection->set_pull({});
}

TEST(Delivery, APausedPeerWaitsAndTheOthersDoNot) {
  std::mutex mutex;
  std::vector<std::string> seen;
  Server server({.on_message = [&](const ConnectionPtr& connection, const v1::Envelope& message) -> Status {
    if (message.presence().name().starts_with("pause")) connection->pause_reading();
    const std::lock_guard lock(mutex);
    seen.push_back(message.presence().name());
    return {};
  }});
  const auto what_came = [&] {
    const std::lock_guard lock(mutex);
    return seen;
  };
  SyncClient paused = server.connect("paused");
  SyncClient other = server.connect("other");
  for (const char* name : {"pause 1", "pause 2", "last"}) ASSERT_TRUE(paused.send(presence(name)).ok());
  server.wait_until([&] { return what_came().size() == 1; });
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(other.send(presence("other")).ok());
  server.wait_until([&] { return what_came().size() == 101; });
  EXPECT_THAT(what_came(), testing::Not(testing::Contains("pause 2")));
  const ConnectionPtr connection = server.connection(paused.welcome().client_id());
  connection->resume_reading();
  server.wait_until([&] { return what_came().size() == 102; });
  EXPECT_EQ(what_came().back(), "pause 2");
  connection->resume_reading();
  server.wait_until([&] { return what_came().size() == 103; });
  EXPECT_EQ(what_came().back(), "last");
  connection->resume_reading();  // of nothing
}

TEST(Delivery, APausedPeerCanBeClosed) {
  Server server({.on_message = [&](const ConnectionPtr& connection, const v1::Envelope&) -> Status {
    connection->pause_reading();
    return {};
  }});
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.send(presence("x")).ok());
  server.wait_for_messages(1);
  connection->fail(make_error(ErrorCode::cancelled, "enough"));
  const auto failure = client.receive(patience);
  ASSERT_TRUE(failure.ok()) << failure.error().describe();
  EXPECT_EQ(failure->failure().message(), "enough");
  EXPECT_THAT(server.close_reason(connection->id()), testing::HasSubstr("enough"));
}

TEST(Delivery, OnlyTheRolesThatAreServedAreWelcome) {
  Server server({.options = {.roles = {v1::ROLE_VIEWER, v1::ROLE_SUBSCRIBER}}});
  const auto refused = SyncClient::connect(server.endpoint(), Server::client_options(), server.clock());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::permission_denied);
  EXPECT_EQ(refused.error().field, "hello.role");
  ClientOptions viewer = Server::client_options();
  viewer.role = v1::ROLE_VIEWER;
  EXPECT_TRUE(SyncClient::connect(server.endpoint(), viewer, server.clock()).ok());
}

TEST(Delivery, AnOverflowReseedsOrCloses) {
  std::atomic<int> overflows{0};
  Server server({.options = {.outbox = {.max_queued_frames = 10}, .send_buffer_bytes = 4096},
                 .on_overflow = [&](const ConnectionPtr& connection) {
                   ++overflows;
                   if (connection->peer().name == "closed") return OverflowAction::close;
                   connection->send(presence("snapshot"));
                   return OverflowAction::reseed;
                 }});
  for (const std::string name : {"reseeded", "closed"}) {
    SyncClient client = server.connect(name);
    const ConnectionPtr connection = server.connection(client.welcome().client_id());
    while (connection->send(presence("event", 0, 1000))) {
    }
    std::string last;
    bool over = false;
    while (!over) {
      const auto message = client.receive(patience);
      ASSERT_TRUE(message.ok()) << message.error().describe();
      if (message->has_failure()) {
        EXPECT_EQ(message->failure().code(), "resource_exhausted");
        over = true;
      } else {
        last = message->presence().name();
        over = last == "snapshot";
      }
    }
    EXPECT_EQ(last == "snapshot", name == "reseeded");
    EXPECT_EQ(connection->statistics().overflows, 1u);
  }
  EXPECT_EQ(overflows, 2);
}

TEST(Delivery, AReplayMayWaitForItsReader) {
  Server server({.options = {.send_buffer_bytes = 4096}});
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  constexpr std::int64_t count = 500;
  std::thread replay([&] {
    for (std::int64_t i = 1; i <= count; ++i) {
      ASSERT_TRUE(connection->wait_until_queued_below(4, patience));
      ASSERT_TRUE(connection->send(presence("every", i, 1000)));
      ASSERT_LE(connection->statistics().queued_frames, 4u);
    }
  });
  for (std::int64_t i = 1; i <= count; ++i)
    ASSERT_EQ(client.receive(patience)->presence().capture_time_ns(), i);
  replay.join();
  EXPECT_FALSE(connection->wait_until_queued_below(0, std::chrono::milliseconds(1))) << "never below zero";
}

TEST(Delivery, ThirtyTwoSubscribersGetEveryFrame) {
  Server server;
  std::vector<SyncClient> clients;
  std::vector<ConnectionPtr> connections;
  for (int i = 0; i < 32; ++i) {
    clients.push_back(server.connect());
    connections.push_back(server.connection(clients.back().welcome().client_id()));
  }
  for (std::int64_t i = 1; i <= 100; ++i) {
    const Frame frame = frame_of(presence("all", i, 500));
    for (const ConnectionPtr& connection : connections) ASSERT_TRUE(connection->send(frame));
  }
  for (SyncClient& client : clients) {
    for (std::int64_t i = 1; i <= 100; ++i) {
      const auto message = client.receive(patience);
      ASSERT_TRUE(message.ok()) << message.error().describe();
      ASSERT_EQ(message->presence().capture_time_ns(), i);
    }
  }
}

TEST(Delivery, StoppingFlushesWhatIsQueuedAndRemovesTheSocket) {
  Server server;
  SyncClient client = server.connect();
  const ConnectionPtr connection = server.connection(client.welcome().client_id());
  ASSERT_TRUE(connection->send(presence("last words", 0, 1u << 20)));
  (*server).stop();
  EXPECT_FALSE(connection->send(presence("too late")));
  const auto last = client.receive(patience);
  ASSERT_TRUE(last.ok()) << last.error().describe();
  EXPECT_EQ(last->presence().name(), "last words");
  EXPECT_EQ(client.receive(patience).error().code, ErrorCode::io);
  server.wait_until([&] { return !std::filesystem::exists(server.endpoint().path); });
}

}  // namespace
}  // namespace handloft::net
