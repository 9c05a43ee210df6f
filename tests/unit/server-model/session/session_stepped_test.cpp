// The seam of the simulation: an actor and its store whose every piece of work the test does itself. Nothing
// happens by itself, and an answer comes when the disk has it and not before.

#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "server-model/session/model_actor.h"
#include "tests/support/stepped_queue.h"
#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

struct Stepped : ::testing::Test {
  std::shared_ptr<test::SteppedQueue> model = std::make_shared<test::SteppedQueue>();
  std::shared_ptr<test::SteppedQueue> pool = std::make_shared<test::SteppedQueue>();
  std::shared_ptr<test::SteppedQueue> disk = std::make_shared<test::SteppedQueue>();
  std::shared_ptr<test::SteppedQueue> snapshots = std::make_shared<test::SteppedQueue>();
  test::TemporaryDirectory folder;
  ManualClock clock;

  store::ModelStore::Opened open() {
    store::ModelStoreOptions options;
    options.commit.queue = disk;
    options.snapshots = snapshots;
    options.snapshot_every = 2;
    auto opened = store::ModelStore::open(folder.path() / "model", {}, options);
    EXPECT_TRUE(opened.ok()) << opened.error().describe();
    return *std::move(opened);
  }
  std::unique_ptr<ModelActor> start(store::ModelStore::Opened opened) {
    ActorOptions options;
    options.threads = [this] { return ActorThreads{model, pool}; };
    options.store = std::move(opened.store);
    return std::make_unique<ModelActor>(std::move(opened.model), std::move(options), ActorEvents{}, clock,
                                        Logger("test", LogLevel::off));
  }
  static v1::Operation stroke(double x) {
    v1::Operation operation;
    auto& request = *operation.mutable_add_points();
    request.set_entity("a");
    if (x == 0) request.mutable_create();
    request.add_points()->mutable_position()->set_x(x);
    request.mutable_points(0)->set_pressure(1);
    return operation;
  }
};

TEST_F(Stepped, NothingHappensByItself) {
  auto actor = start(open());
  std::optional<std::uint64_t> answered;
  actor->submit(stroke(0), {}, [&](const auto& outcome) { answered = outcome ? outcome->sequence : 0; });
  EXPECT_EQ(actor->scene()->sequence, 0U);
  EXPECT_FALSE(actor->idle());
  EXPECT_TRUE(model->step());
  EXPECT_EQ(actor->scene()->sequence, 1U);  // Seen at once,
  EXPECT_FALSE(answered.has_value());       // and answered when it is safe.
  EXPECT_EQ(disk->waiting(), 1U);
  EXPECT_TRUE(disk->step());
  EXPECT_EQ(answered, 1U);
}

TEST_F(Stepped, AllThatComesMeanwhileGoesIntoOneCommit) {
  auto opened = open();
  const auto kept = opened.store;
  auto actor = start(std::move(opened));
  int answers = 0;
  for (int i = 0; i < 10; ++i) {
    actor->submit(stroke(0.01 * i), {}, [&](const auto& outcome) { answers += outcome.ok() ? 1 : 0; });
  }
  EXPECT_EQ(actor->state().sequence, 10U);
  EXPECT_EQ(answers, 0);
  disk->step();
  EXPECT_EQ(answers, 10);
  EXPECT_EQ(kept->statistics().commits, 1U);
  // The snapshot is prepared in its queue and written, a step at a time, in the disk's.
  EXPECT_EQ(kept->statistics().snapshots, 0U);
  snapshots->run_all();
  disk->run_all();
  EXPECT_EQ(kept->statistics().snapshots, 1U);
}

TEST_F(Stepped, StoppingWritesWhatWaits) {
  {
    auto actor = start(open());
    actor->submit(stroke(0), {}, [](const auto&) {});
    model->run_all();
    actor->stop();
    EXPECT_EQ(actor->state().sequence, 1U);
  }
  disk->run_all();  // What was scheduled finds nobody.
  disk = std::make_shared<test::SteppedQueue>();
  EXPECT_EQ(open().model.sequence(), 1U);
}

// Found by the simulation: the retry was refused, and its client believed that nothing had happened.
TEST_F(Stepped, H3ARetryIsAnsweredThoughSomebodyHasLeasedTheShapeSince) {
  auto actor = start(open());
  const auto answer_to = [&](const v1::Operation& operation) {
    Result<ModelActor::Outcome> answer = make_error(ErrorCode::internal, "none");
    actor->submit(operation, {}, [&](const auto& outcome) { answer = outcome; });
    model->run_all();
    disk->run_all();
    return answer;
  };
  ASSERT_TRUE(answer_to(stroke(0)).ok());
  v1::Operation mine;
  mine.mutable_transform()->add_entities("a");
  mine.mutable_transform()->mutable_translation()->set_x(0.1);
  mine.set_client_id(1);
  mine.set_client_op_id(7);
  const auto first = answer_to(mine);
  ASSERT_TRUE(first.ok()) << first.error().describe();
  actor->viewer_came(2, "Ann", [] {});
  Status leased = make_error(ErrorCode::internal, "none");
  actor->lease(2, "a", ModelActor::LeaseWish::take, [&](const Status& status) { leased = status; });
  model->run_all();
  ASSERT_TRUE(leased.ok()) << leased.error().describe();
  const auto again = answer_to(mine);
  ASSERT_TRUE(again.ok()) << again.error().describe();
  EXPECT_EQ(again->sequence, first->sequence);
  v1::Operation another = mine;
  another.set_client_op_id(8);
  EXPECT_FALSE(answer_to(another).ok()) << "negative control: a new one is refused";
}

}  // namespace
}  // namespace handloft::session
