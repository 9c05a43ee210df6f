// A viewer among hostile servers (V5, F1, F2): whatever comes, it lives, holds a bounded amount of memory,
// shows the last good picture, says what is wrong, and takes the good scene again when it is sent. Here the
// feed alone, one attack a test; hostile_program_test.cpp has the program.

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "client-hmd/mirror/model_feed.h"
#include "tests/integration/client-hmd/hostile_attacks.h"
#include "tests/support/eventually.h"
#include "tests/support/test_data.h"
#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client {
namespace {

using handloft::test::HostileConnection;
using handloft::test::HostileServer;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::Attack;
using test::Outcome;

/// As the frame loop does.
bool eventually(const std::function<bool()>& condition) {
  return handloft::test::eventually(condition, handloft::test::hostile_patience);
}

/// A step that two threads reach together.
class Milestone {
 public:
  void reach() {
    const std::lock_guard lock(mutex_);
    reached_ = true;
    changed_.notify_all();
  }
  bool wait() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, handloft::test::hostile_patience, [this] { return reached_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool reached_ = false;
};

std::size_t points_of(const ModelFeed& feed) {
  const std::shared_ptr<const ModelState> state = feed.state();
  const auto found = state->scene->entities.find("top");
  return found == state->scene->entities.end() ? 0 : found->second->points->points.size();
}

class HostileServers : public testing::Test {
 protected:
  net::Endpoint endpoint() const {
    return *net::parse_endpoint("unix:" + (folder_.path() / "s.sock").string());
  }
  handloft::test::TemporaryDirectory folder_;
  SystemClock clock_;
};

class AnAttack : public HostileServers, public testing::WithParamInterface<Attack> {};

TEST_P(AnAttack, LeavesThePictureAndTheNextGoodSceneIsTaken_V5) {
  const Attack& attack = GetParam();
  Milestone good, attacked, looked;
  std::atomic<bool> survived{false};
  std::atomic<int> connections{0};
  const auto serve = [&](HostileConnection& client) {
    if (!test::serve_good_scene(client)) return;
    if (++connections > 1) return client.hold();
    good.reach();
    survived = attack.run(client) && client.survives();
    attacked.reach();
    if (!looked.wait() || !survived) return;
    (void)test::send_good_scene(client);
    client.hold();
  };
  std::unique_ptr<ModelFeed> feed;
  HostileServer server(endpoint(), serve);
  feed = ModelFeed::start(endpoint(), clock_, Logger("feed", LogLevel::off));
  ASSERT_TRUE(good.wait());
  ASSERT_TRUE(eventually([&] { return points_of(*feed) == test::good_points; }));
  ASSERT_TRUE(attacked.wait());

  EXPECT_EQ(points_of(*feed), test::good_points) << "the last good picture stays";
  EXPECT_EQ(survived, attack.outcome != Outcome::hangs_up);
  const std::uint64_t refused = feed->statistics().mirror.refused;
  if (attack.outcome == Outcome::refused) {
    EXPECT_GE(refused, 1U);
    EXPECT_FALSE(feed->state()->refusal.empty()) << "and it is said why";
  }
  EXPECT_LE(feed->state()->refusal.size(), 256U);
  EXPECT_LE(feed->state()->problem.size(), 256U);
  EXPECT_EQ(feed->state()->problem.find('\x1B'), std::string::npos)
      << "nothing that moves a terminal's cursor";
  const std::uint64_t snapshots = feed->state()->snapshots;
  looked.reach();
  ASSERT_TRUE(eventually([&] {
    return feed->state()->connected && feed->state()->snapshots > snapshots &&
           points_of(*feed) == test::good_points;
  }));
  EXPECT_TRUE(feed->state()->refusal.empty()) << feed->state()->refusal;
  feed.reset();
}

INSTANTIATE_TEST_SUITE_P(Every, AnAttack, testing::ValuesIn(test::attacks()),
                         [](const testing::TestParamInfo<Attack>& item) { return item.param.name; });

class ABadGreeting : public HostileServers, public testing::WithParamInterface<test::BadGreeting> {};

TEST_P(ABadGreeting, IsToldAndTriedAgain_V5) {
  std::atomic<int> connections{0};
  const auto serve = [&](HostileConnection& client) {
    const int number = ++connections;
    if (number <= 2) {
      (void)client.receive_until([](const v1::Envelope& e) { return e.has_hello(); });
      GetParam().run(client);
      return;
    }
    if (test::serve_good_scene(client)) client.hold();
  };
  HostileServer server(endpoint(), serve);
  const std::unique_ptr<ModelFeed> feed = ModelFeed::start(endpoint(), clock_, Logger("feed", LogLevel::off));
  ASSERT_TRUE(eventually([&] { return !feed->state()->problem.empty() || feed->state()->connected; }));
  EXPECT_LE(feed->state()->problem.size(), 256U);
  ASSERT_TRUE(eventually([&] { return points_of(*feed) == test::good_points; }));
  EXPECT_GE(connections, 3);
  EXPECT_EQ(feed->statistics().connects, 1U) << "what was greeted badly was no connection";
}

INSTANTIATE_TEST_SUITE_P(Every, ABadGreeting, testing::ValuesIn(test::bad_greetings()),
                         [](const testing::TestParamInfo<test::BadGreeting>& item) {
                           return std::string(item.param.name);
                         });

TEST_F(HostileServers, AnotherVersionIsToldInWords_V5) {
  HostileServer server(endpoint(), [](HostileConnection& client) {
    (void)client.receive_until([](const v1::Envelope& e) { return e.has_hello(); });
    test::bad_greetings().front().run(client);
    client.hold();
  });
  const std::unique_ptr<ModelFeed> feed = ModelFeed::start(endpoint(), clock_, Logger("feed", LogLevel::off));
  ASSERT_TRUE(eventually([&] { return !feed->state()->problem.empty(); }));
  EXPECT_NE(feed->state()->problem.find("speaks protocol 2.0, this program 1."), std::string::npos)
      << feed->state()->problem;
  EXPECT_FALSE(feed->state()->connected);
}

TEST_F(HostileServers, AServerThatComesBackWithTheSameSceneChangesNothing_V5) {
  std::atomic<std::uint64_t> epoch{1};
  std::atomic<int> served{0};
  Milestone restart;
  const auto serve = [&](HostileConnection& client) {
    if (!client.greet() || !client.wait_for_join()) return;
    v1::Envelope envelope;
    *envelope.mutable_snapshot() = test::snapshot();
    envelope.mutable_snapshot()->set_epoch(epoch++);
    if (!client.send(envelope) || !client.survives()) return;
    if (++served == 1) {
      (void)restart.wait();
    } else {
      client.hold();
    }
  };
  HostileServer server(endpoint(), serve);
  const std::unique_ptr<ModelFeed> feed = ModelFeed::start(endpoint(), clock_, Logger("feed", LogLevel::off));
  ASSERT_TRUE(eventually([&] { return points_of(*feed) == test::good_points; }));
  const std::shared_ptr<const Entity> before = feed->state()->scene->entities.at("top");
  restart.reach();
  // All the while there is a picture, and it is the same one.
  ASSERT_TRUE(eventually([&] {
    const std::shared_ptr<const Scene> scene = feed->state()->scene;
    const auto found = scene->entities.find("top");
    EXPECT_NE(found, scene->entities.end());
    if (found == scene->entities.end()) return true;
    EXPECT_EQ(found->second->points, before->points);
    EXPECT_EQ(found->second->surface, before->surface) << "nothing is uploaded again";
    return scene->epoch == 2;
  }));
  EXPECT_EQ(feed->statistics().join_to_scene.count(), 2U);
  EXPECT_LT(feed->statistics().join_to_scene.longest_ms(), 1000.0);
}

TEST_F(HostileServers, AServerThatComesBackInPiecesDoesNotFlicker_V5) {
  std::atomic<int> served{0};
  Milestone restart, bare, complete;
  const auto serve = [&](HostileConnection& client) {
    if (!client.greet() || !client.wait_for_join()) return;
    v1::Envelope envelope;
    *envelope.mutable_snapshot() = test::snapshot();
    if (++served == 1) {
      (void)(client.send(envelope) && client.survives());
      (void)restart.wait();
      return;
    }
    // As a server that tessellates anew: the shape at once, its surface a little later.
    envelope.mutable_snapshot()->set_epoch(8);
    envelope.mutable_snapshot()->mutable_entities(0)->clear_surface();
    if (!client.send(envelope) || !client.survives()) return;
    bare.reach();
    (void)complete.wait();
    v1::Envelope later;
    *later.mutable_delta() = test::delta();
    later.mutable_delta()->set_epoch(8);
    *later.mutable_delta()->mutable_changed(0)->mutable_surface() = test::triangle(0.2F);
    if (client.send(later)) client.hold();
  };
  HostileServer server(endpoint(), serve);
  ManualClock clock(from_ns(1'000'000'000));
  const std::unique_ptr<ModelFeed> feed = ModelFeed::start(endpoint(), clock, Logger("feed", LogLevel::off));
  ASSERT_TRUE(eventually([&] { return points_of(*feed) == test::good_points; }));
  const std::shared_ptr<const Scene> before = feed->state()->scene;
  restart.reach();
  ASSERT_TRUE(bare.wait());
  ASSERT_TRUE(eventually([&] { return feed->state()->snapshots == 2; }));
  EXPECT_EQ(feed->state()->scene, before) << "what lacks its surface is not shown yet";
  clock.advance(milliseconds(400));
  complete.reach();
  ASSERT_TRUE(eventually([&] { return feed->state()->scene->epoch == 8; }));
  EXPECT_NE(feed->state()->scene->entities.at("top")->surface, nullptr);
}

TEST_F(HostileServers, AServerThatLostItsSceneIsSeenToHaveLostItAfterHalfASecond_V5) {
  std::atomic<int> served{0};
  Milestone restart;
  const auto serve = [&](HostileConnection& client) {
    if (!client.greet() || !client.wait_for_join()) return;
    v1::Envelope envelope;
    *envelope.mutable_snapshot() = test::snapshot();
    if (++served > 1) envelope.mutable_snapshot()->clear_entities();
    envelope.mutable_snapshot()->set_epoch(static_cast<std::uint64_t>(served));
    if (!client.send(envelope) || !client.survives()) return;
    if (served == 1) {
      (void)restart.wait();
    } else {
      client.hold();
    }
  };
  HostileServer server(endpoint(), serve);
  ManualClock clock(from_ns(1'000'000'000));
  const std::unique_ptr<ModelFeed> feed = ModelFeed::start(endpoint(), clock, Logger("feed", LogLevel::off));
  ASSERT_TRUE(eventually([&] { return points_of(*feed) == test::good_points; }));
  restart.reach();
  ASSERT_TRUE(eventually([&] { return feed->state()->snapshots == 2; }));
  EXPECT_EQ(points_of(*feed), test::good_points);
  clock.advance(milliseconds(500));
  EXPECT_EQ(feed->state()->scene->epoch, 2U) << "without another message";
  EXPECT_TRUE(feed->state()->scene->entities.empty());
}

}  // namespace
}  // namespace handloft::client
