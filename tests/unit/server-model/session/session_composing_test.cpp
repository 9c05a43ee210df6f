// While much is composed for somebody who joins, the others go on (C3, L2): nobody waits for that, nothing of
// it is composed on the model's thread, and who joins misses nothing of what comes meanwhile.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tests/unit/server-model/session/peers_fixture.h"

namespace handloft::session {
namespace {

constexpr std::chrono::seconds patience{20};
constexpr int many_points = 3000;

v1::Operation cloud(const std::string& id, int count = many_points) {
  v1::Operation operation;
  auto& add = *operation.mutable_add_points();
  add.set_entity(id);
  add.mutable_create();
  for (int i = 0; i < count; ++i) {
    v1::Point& point = *add.add_points();
    point.mutable_position()->set_x(1e-4 * i);
    point.set_pressure(0.5);
  }
  return operation;
}

v1::Operation one_point(const std::string& id) {
  v1::Operation operation;
  operation.mutable_add_points()->set_entity(id);
  operation.mutable_add_points()->add_points()->mutable_position()->set_x(0.01);
  return operation;
}

/// Stops one thread where it looks at the time, as it does when it has packed something.
class TrapClock final : public Clock {
 public:
  TimePoint now() const override {
    std::unique_lock lock(mutex_);
    if (shut_ && std::this_thread::get_id() == whom_) {
      caught_ = true;
      changed_.notify_all();
      changed_.wait_for(lock, patience, [this] { return !shut_; });
    }
    return from_ns(1'000'000'000'000);
  }
  /// From the thread that is to be caught.
  void shut() {
    const std::lock_guard lock(mutex_);
    whom_ = std::this_thread::get_id();
    shut_ = true;
  }
  bool wait_until_caught() const {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, [this] { return caught_; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    shut_ = false;
    changed_.notify_all();
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  mutable bool caught_ = false;
  bool shut_ = false;
  std::thread::id whom_;
};

class ComposingTest : public PeersTest {
 protected:
  static std::uint64_t last_sequence(const ConnectionPtr& connection) {
    std::uint64_t last = 0;
    for (const v1::Envelope& sent : connection->sent()) {
      if (sent.has_snapshot()) last = sent.snapshot().sequence();
      if (sent.has_delta()) last = sent.delta().sequence();
    }
    return last;
  }
  /// A viewer whose messages are pulled by the test alone.
  ConnectionPtr stalled(v1::Role role, const std::string& name) {
    const ConnectionPtr connection = connect(role, name);
    connection->stall();
    join(connection, {});
    return connection;
  }
};

TEST_F(ComposingTest, L2_nobody_waits_while_a_scene_is_packed_for_somebody_else) {
  TrapClock clock;
  const auto peers = Peers::start(model::Model(), {}, clock, Logger("test", LogLevel::off));
  const net::ServerEvents events = peers->events(net::Endpoint::Kind::unix_socket);
  const auto come = [&](std::uint64_t id, v1::Role role) {
    net::PeerInfo info;
    info.role = role;
    info.name = std::to_string(id);
    info.protocol_minor = net::protocol_minor;
    auto connection = std::make_shared<test::FakeConnection>(id, info);
    EXPECT_TRUE(events.on_join(connection).ok());
    return connection;
  };
  const auto say = [&](const ConnectionPtr& connection, const v1::Envelope& envelope) {
    EXPECT_TRUE(events.on_message(connection, envelope).ok());
  };
  const auto submit = [&](const ConnectionPtr& connection, const v1::Operation& operation,
                          std::uint64_t request) {
    v1::Envelope envelope;
    envelope.mutable_submit()->set_request(request);
    *envelope.mutable_submit()->mutable_operation() = operation;
    say(connection, envelope);
  };
  const auto has_ack = [](const ConnectionPtr& connection, std::uint64_t request) {
    const auto deadline = std::chrono::steady_clock::now() + patience / 2;
    while (std::chrono::steady_clock::now() < deadline) {
      for (const v1::Envelope& sent : connection->sent()) {
        if (sent.has_ack() && sent.ack().request() == request) return true;
      }
      std::this_thread::yield();
    }
    return false;
  };
  v1::Envelope join;
  join.mutable_join();
  const ConnectionPtr editor = come(1, v1::ROLE_EDITOR);
  say(editor, join);
  submit(editor, cloud("large"), 1);
  ASSERT_TRUE(has_ack(editor, 1));
  const ConnectionPtr late = come(2, v1::ROLE_VIEWER);
  late->stall();
  say(late, join);
  peers->actor().settle();

  std::thread writer([&] {
    clock.shut();
    late->read_on();  // Packs "large", and is caught with that.
  });
  const bool caught = clock.wait_until_caught();
  EXPECT_TRUE(caught);
  if (caught) {
    submit(editor, one_point("large"), 2);
    EXPECT_TRUE(has_ack(editor, 2)) << "an answer waits for somebody else's scene";
    // What tells all of somebody looks at all: presence, people, figures.
    v1::Envelope presence;
    presence.mutable_presence()->set_name("hand");
    say(editor, presence);
    const ConnectionPtr third = come(3, v1::ROLE_VIEWER);
    EXPECT_EQ(peers->viewer_count(), 2U);
    events.on_closed(third, "as it likes");
    submit(editor, one_point("large"), 3);
    EXPECT_TRUE(has_ack(editor, 3));
  }
  clock.open();
  writer.join();
  peers->actor().settle();
  EXPECT_EQ(last_sequence(late), 3U) << "with what came while it was packed";
  peers->actor().stop();
}

TEST_F(ComposingTest, L2_who_is_behind_is_not_told_again_and_misses_nothing) {
  const ConnectionPtr editor = joined(v1::ROLE_EDITOR, "editor");
  ASSERT_FALSE(ack(editor, submit(editor, cloud("a"))).has_failure());
  const ConnectionPtr late = stalled(v1::ROLE_VIEWER, "late");
  const int told = late->notified();
  for (int i = 0; i < 5; ++i) (void)submit(editor, one_point("a"));
  (void)settled();
  EXPECT_EQ(late->notified(), told) << "the model's thread leaves it to who writes";
  late->read_on();
  EXPECT_EQ(last_sequence(late), 6U);
  EXPECT_EQ(seen(late, "a").points().total(), many_points + 5U);
  // Once it has all, the shortest way.
  const int then = late->notified();
  (void)submit(editor, one_point("a"));
  (void)settled();
  EXPECT_EQ(late->notified(), then + 1);
  EXPECT_EQ(last_sequence(late), 7U);
}

TEST_F(ComposingTest, C3_what_comes_between_two_messages_of_a_scene_comes_after_them) {
  ServerOptions options;
  options.viewer.max_message_bytes = 1;  // One entity a message.
  start(options);
  const ConnectionPtr editor = joined(v1::ROLE_EDITOR, "editor");
  for (const char* id : {"a", "b", "c"}) (void)ack(editor, submit(editor, cloud(id, 10'000)));
  const ConnectionPtr late = stalled(v1::ROLE_VIEWER, "late");
  ASSERT_TRUE(late->pull_one());
  (void)ack(editor, submit(editor, one_point("a")));
  (void)ack(editor, submit(editor, one_point("c")));
  while (late->pull_one()) {
  }
  EXPECT_EQ(last_sequence(late), 5U);
  for (const char* id : {"a", "c"}) EXPECT_EQ(seen(late, id).points().total(), 10'001U) << id;
  EXPECT_EQ(seen(late, "b").points().total(), 10'000U);
  // It joins again in the middle of a scene: what it says then is what counts.
  join(late, {});
  ASSERT_TRUE(late->pull_one());
  join(late, {});
  ASSERT_TRUE(late->pull_one());
  int snapshots = 0;
  for (const v1::Envelope& sent : late->sent()) snapshots += sent.has_snapshot() ? 1 : 0;
  EXPECT_EQ(snapshots, 3);
}

// The writer asks until it is told that there is nothing, then waits to be notified: whatever the moments at
// which the model's thread and it look, it has all in the end.
TEST_F(ComposingTest, C3_no_news_is_lost_between_two_threads) {
  constexpr std::uint64_t operations = 400;
  const ConnectionPtr editor = joined(v1::ROLE_EDITOR, "editor");
  (void)ack(editor, submit(editor, cloud("a", 10'000)));
  const ConnectionPtr late = connect(v1::ROLE_VIEWER, "late");
  late->stall();
  std::atomic<bool> ends = false;
  std::thread writer([&] {
    int done = -1;
    while (true) {
      const bool last = ends;
      const int told = late->notified();
      if (told != done) {
        while (late->pull_one()) {
        }
        done = told;
      } else if (last) {
        return;
      }
      std::this_thread::yield();
    }
  });
  join(late, {});
  for (std::uint64_t i = 1; i < operations; ++i) {
    if (i % 20 == 0) {
      // It falls behind anew, in the middle of all.
      (void)submit(editor, cloud("cloud" + std::to_string(i), 5000));
    } else {
      (void)submit(editor, one_point("a"));
    }
    if (i % 50 == 0) join(late, {});
  }
  (void)settled();
  ends = true;
  writer.join();
  EXPECT_EQ(last_sequence(late), operations);
  EXPECT_FALSE(late->pull_one()) << "something was left";
}

TEST_F(ComposingTest, C3_all_who_come_share_what_was_packed_and_it_is_counted) {
  const ConnectionPtr editor = joined(v1::ROLE_EDITOR, "editor");
  (void)ack(editor, submit(editor, cloud("a")));
  const std::uint64_t packed = peers_->packs().packed;
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(seen(joined(v1::ROLE_VIEWER, "late"), "a").points().total(), many_points);
  EXPECT_EQ(peers_->packs().packed, packed);
  EXPECT_EQ(peers_->packs().shared, 5U);
  EXPECT_GT(peers_->packs().bytes, 14U * many_points);
  // Nobody comes any more.
  clock_.advance(std::chrono::minutes(1));
  peers_->tick();
  EXPECT_EQ(peers_->packs().bytes, 0U);
}

}  // namespace
}  // namespace handloft::session
