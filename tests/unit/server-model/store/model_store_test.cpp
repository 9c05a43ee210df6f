// A model that is kept while it is worked on: what was applied is there after reopening, snapshots come by
// themselves, old retries are answered, and a disk that fails makes the model read-only in words (U5, D5,
// H3).

#include "server-model/store/model_store.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <future>
#include <string>

#include "server-model/model/canonical.h"
#include "tests/support/fault_disk.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;

v1::Operation stroke(std::uint64_t number) {
  v1::Operation operation;
  operation.set_client_id(4);
  operation.set_client_op_id(number);
  auto& request = *operation.mutable_add_points();
  request.set_entity("a");
  if (number == 1) request.mutable_create();
  for (int i = 0; i < 3; ++i) {
    v1::Point& point = *request.add_points();
    point.mutable_position()->set_x(0.001 * static_cast<double>(number) + 0.01 * i);
    point.set_pressure(1);
  }
  return operation;
}

class KeptModel : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "handloft-kept-XXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder = pattern;
  }
  void TearDown() override { fs::remove_all(folder); }

  ModelStore::Opened open(std::uint64_t snapshot_every = 1000) {
    ModelStoreOptions options;
    options.snapshot_every = snapshot_every;
    auto opened = ModelStore::open(folder / "model", {}, options);
    EXPECT_TRUE(opened.ok()) << opened.error().describe();
    return *std::move(opened);
  }

  fs::path folder;
};

TEST_F(KeptModel, IsTheSameAfterReopeningAndGoesOn) {
  std::string hash;
  for (std::uint64_t start = 0; start < 3; ++start) {
    auto kept = open();
    EXPECT_EQ(kept.store->epoch(), start + 1);
    EXPECT_EQ(kept.model.sequence(), 10 * start);
    if (start > 0) {
      EXPECT_EQ(model::document_hash(kept.model.document()), hash);
    }
    for (std::uint64_t i = 1; i <= 10; ++i) ASSERT_TRUE(kept.model.submit(stroke(10 * start + i)).ok());
    hash = model::document_hash(kept.model.document());
    std::promise<Status> durable;
    kept.store->when_durable(10 * (start + 1), [&](const Status& status) { durable.set_value(status); });
    EXPECT_TRUE(durable.get_future().get().ok());
    EXPECT_EQ(kept.store->durable_sequence(), 10 * (start + 1));
  }
}

TEST_F(KeptModel, SnapshotsComeByThemselvesAndBoundTheReplay) {
  {
    auto kept = open(50);
    for (std::uint64_t i = 1; i <= 400; ++i) {
      ASSERT_TRUE(kept.model.submit(stroke(i)).ok());
      if (i % 50 == 0) kept.store->flush();
    }
    // The writing thread has it once the other one has made it.
    while (kept.store->statistics().snapshots == 0) kept.store->flush();
  }
  auto kept = open();
  EXPECT_GE(kept.snapshot_sequence, 50U);
  EXPECT_EQ(kept.snapshot_sequence + kept.replayed, 400U);
  EXPECT_EQ(kept.model.history().undo_steps(), 400U);
}

TEST_F(KeptModel, H3ARetryOlderThanTheModelRemembersIsAnsweredFromTheLog) {
  auto kept = open();
  const std::uint64_t many = model::Model::remembered_answers + 20;
  for (std::uint64_t i = 1; i <= many; ++i) ASSERT_TRUE(kept.model.submit(stroke(i)).ok());
  kept.store->flush();
  const auto again = kept.model.submit(stroke(3));
  ASSERT_TRUE(again.ok()) << again.error().describe();
  EXPECT_EQ(again->sequence, 3U);
  EXPECT_EQ(again->changes.changed, std::vector<std::string>{"a"});
  EXPECT_EQ(kept.model.sequence(), many);
}

TEST_F(KeptModel, ARefusedOperationLeavesNothing) {
  auto kept = open();
  v1::Operation fit;
  fit.mutable_fit()->set_entity("nothing");
  EXPECT_FALSE(kept.model.submit(fit).ok());
  kept.store->flush();
  EXPECT_EQ(kept.store->durable_sequence(), 0U);
}

TEST_F(KeptModel, D5AFullDiskRefusesEveryOperationAndTellsWhoWaits) {
  test::FaultDisk disk;
  ModelStoreOptions options;
  options.log.vfs = disk.name();
  options.log.mark = LogOptions::Mark::none;
  options.snapshot_every = 1'000'000;
  auto opened = ModelStore::open("model", {}, options);
  ASSERT_TRUE(opened.ok()) << opened.error().describe();
  // Without numbers that are looked for in the file: the disk in memory is for one thread.
  const auto once = [](std::uint64_t number) {
    v1::Operation operation = stroke(number);
    operation.clear_client_op_id();
    return operation;
  };
  for (std::uint64_t i = 1; i <= 5; ++i) ASSERT_TRUE(opened->model.submit(once(i)).ok());
  opened->store->flush();
  disk.fail_at(0, test::FaultDisk::Failure::full_for_good);
  ASSERT_TRUE(opened->model.submit(once(6)).ok());
  std::promise<Status> told;
  opened->store->when_durable(6, [&](const Status& status) { told.set_value(status); });
  EXPECT_EQ(told.get_future().get().error().code, ErrorCode::resource_exhausted);
  opened->store->flush();
  const auto refused = opened->model.submit(once(7));
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("the disk is full"), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("can be looked at and exported"), std::string::npos);
  EXPECT_EQ(opened->model.sequence(), 6U);
  EXPECT_EQ(opened->store->durable_sequence(), 5U);
}

TEST_F(KeptModel, AFileOfAnotherKindIsNotMadeAnew) {
  { auto kept = open(); }
  auto kept = open();
  const auto second = ModelStore::open(folder / "model", {});
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("in use by another"), std::string::npos) << second.error().message;
}

}  // namespace
}  // namespace handloft::store
