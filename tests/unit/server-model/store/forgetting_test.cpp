// U1, D6, D8: a busy script pushes nobody's steps out of undo, not after a crash either, and a log of format
// 2, whose histories forgot the oldest step of all, replays as it was. Histories of some tens of steps stand
// for those of 10,000.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/store/log_check.h"
#include "server-model/store/model_store.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "server-model/store/repair.h"
#include "server-model/store/snapshot.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/store/client_operations.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;
using Access = OperationLog::Access;

constexpr std::uint64_t script = 0;
using test::ann, test::bob, test::create, test::undo;

v1::Operation rename(std::uint64_t client, const std::string& id, const std::string& name) {
  v1::Operation operation;
  operation.set_client_id(client);
  operation.mutable_rename()->set_entity(id);
  operation.mutable_rename()->set_name(name);
  return operation;
}

model::ApplyContext with_steps(std::size_t most) {
  model::ApplyContext context;
  context.limits.max_history_steps = most;
  return context;
}

class Forgetting : public testing::Test {
 protected:
  /// The file with all that belongs to it, as a crash leaves it.
  fs::path crashed() {
    const fs::path copy = fs::path(folder.path()) / fmt::format("crash-{}.handloft", ++crashes);
    for (const char* suffix : {"", "-wal"}) {
      if (fs::exists(path.string() + suffix)) fs::copy_file(path.string() + suffix, copy.string() + suffix);
    }
    return copy;
  }
  static ModelStoreOptions options(std::uint64_t snapshot_every, std::size_t snapshot_steps) {
    ModelStoreOptions options;
    options.snapshot_every = snapshot_every;
    options.encode.max_steps = snapshot_steps;
    return options;
  }
  /// A file as the program of format 2 left it. Precondition: the log was never of format 1.
  void make_format_2(const fs::path& file) const {
    auto log = OperationLog::open(file, Access::write);
    ASSERT_TRUE(log.ok()) << log.error().describe();
    const LogIdentity identity = log->identity();
    const Digest check =
        row_check({{reinterpret_cast<const char*>(identity.model_id.data()), identity.model_id.size()}}, {1});
    for (const std::string& sql :
         {std::string("DROP TABLE rules"),
          std::string("CREATE TABLE rules (id INTEGER PRIMARY KEY CHECK (id = 1), per_user_from INTEGER NOT "
                      "NULL, check_value BLOB NOT NULL) STRICT"),
          fmt::format("INSERT INTO rules VALUES (1, 1, x'{}')", model::to_hex(model::as_bytes(check))),
          std::string("PRAGMA user_version=2")}) {
      ASSERT_TRUE(log->database().execute(sql).ok()) << sql;
    }
  }

  handloft::test::TemporaryDirectory folder;
  const fs::path path = fs::path(folder.path()) / "seat.handloft";
  int crashes = 0;
};

TEST_F(Forgetting, U1_AfterAScriptsTwelveThousandStepsAndACrashOthersUndoTheirs) {
  // 120 steps where 100 are known and a snapshot keeps 10 stand for 12,000 where 10,000 are known and it
  // keeps 1,000.
  const model::ApplyContext context = with_steps(100);
  fs::path left;
  std::string hash;
  {
    auto opened = ModelStore::open(path, context, options(30, 10));
    ASSERT_TRUE(opened.ok()) << opened.error().describe();
    model::Model& model = opened->model;
    ASSERT_TRUE(model.submit(create(ann, "seat")).ok());
    ASSERT_TRUE(model.submit(rename(ann, "seat", "Ann's")).ok());
    ASSERT_TRUE(model.submit(create(bob, "back")).ok());
    ASSERT_TRUE(model.submit(create(script, "grid")).ok());
    for (int i = 0; i < 120; ++i)
      ASSERT_TRUE(model.submit(rename(script, "grid", fmt::format("grid {}", i))).ok());
    EXPECT_EQ(model.history().undo_steps(ann), 2U);
    EXPECT_EQ(model.history().undo_steps(bob), 1U);
    EXPECT_EQ(model.history().undo_steps(script), 97U);
    opened->store->flush();
    hash = model::document_hash(model.document());
    left = crashed();
    opened->store->stop();
  }
  auto opened = ModelStore::open(left, context, options(30, 10));
  ASSERT_TRUE(opened.ok()) << opened.error().describe();
  model::Model& model = opened->model;
  EXPECT_GT(opened->snapshot_sequence, 0U) << "or this shows little";
  EXPECT_EQ(model::document_hash(model.document()), hash);
  EXPECT_EQ(model.history().undo_steps(ann), 2U);
  EXPECT_EQ(model.history().undo_steps(bob), 1U);
  EXPECT_EQ(model.history().next_undo(ann), "Rename \"seat\" to \"Ann's\"");
  ASSERT_TRUE(model.submit(undo(ann)).ok());
  EXPECT_EQ(model.document().find("seat")->name, "seat");
  ASSERT_TRUE(model.submit(undo(bob)).ok());
  EXPECT_EQ(model.document().find("back"), nullptr);
  ASSERT_TRUE(model.submit(undo(script)).ok());
  EXPECT_EQ(model.document().find("grid")->name, "grid 118");
  ASSERT_TRUE(model.submit(undo(ann)).ok());
  EXPECT_FALSE(model.submit(undo(ann)).ok());
  hash = model::document_hash(model.document());
  opened->store->stop();
  // From whichever snapshot, and from the first operation on, it is the same.
  auto log = OperationLog::open(left, Access::read);
  for (const auto snapshots : {RecoveryOptions::Snapshots::used, RecoveryOptions::Snapshots::ignored}) {
    RecoveryOptions from;
    from.snapshots = snapshots;
    auto recovered = recover(*log, context, from);
    ASSERT_TRUE(recovered.ok()) << recovered.error().describe();
    EXPECT_EQ(model::document_hash(recovered->model.document()), hash);
  }
}

// A server that restarted knows fewer of Ann's steps than there were. If they did not count, it would have
// room for more of Bob's than a replay from the first operation has, and let him undo what that cannot.
TEST_F(Forgetting, D6U1_WhatASnapshotLeavesOutStillCounts) {
  const model::ApplyContext context = with_steps(10);
  auto log = OperationLog::create(path, new_identity(1));
  ASSERT_TRUE(log.ok());
  model::Model model({}, context);
  std::vector<LogRecord> records;
  const auto must = [&](const v1::Operation& operation) {
    const auto submitted = model.submit(operation);
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
    records.push_back(make_record(*submitted, 1, 0));
  };
  for (int i = 0; i < 5; ++i) must(create(ann, fmt::format("a{}", i)));
  for (int i = 0; i < 5; ++i) must(create(bob, fmt::format("b{}", i)));
  model::EncodeOptions encode;
  encode.max_steps = 4;
  auto snapshot = prepare_snapshot({model.history(), model.sequence()}, encode);
  ASSERT_TRUE(snapshot.ok());
  ASSERT_TRUE(log->append(records).ok());
  records.clear();
  ASSERT_TRUE(write_snapshot(*log, *std::move(snapshot), 1).ok());
  auto recovered = recover(*log, context);
  ASSERT_TRUE(recovered.ok());
  EXPECT_EQ(recovered->snapshot_sequence, 10U);
  model = std::move(recovered->model);
  EXPECT_EQ(model.history().undo_steps(ann), 2U);
  EXPECT_EQ(model.history().undo_steps(bob), 2U);
  for (int i = 5; i < 11; ++i) must(create(bob, fmt::format("b{}", i)));
  EXPECT_EQ(model.history().undo_steps(bob), 5U) << "Ann's five count";
  for (int i = 0; i < 5; ++i) must(undo(bob));
  EXPECT_FALSE(model.submit(undo(bob)).ok());
  must(undo(ann));
  must(undo(ann));
  EXPECT_FALSE(model.submit(undo(ann)).ok());
  ASSERT_TRUE(log->append(records).ok());
  RecoveryOptions all;
  all.snapshots = RecoveryOptions::Snapshots::ignored;
  auto whole = recover(*log, context, all);
  ASSERT_TRUE(whole.ok()) << whole.error().describe();
  EXPECT_EQ(model::document_hash(whole->model.document()), model::document_hash(model.document()));
  EXPECT_EQ(whole->model.history().undo_steps(ann), 3U) << "it knows what the snapshot had left out";
}

/// Ann makes 4, a script 8 where 10 steps are known. Format 2 forgot Ann's first two, and let the script take
/// all of its 8 back; the present rule leaves the script 6.
std::vector<LogRecord> by_format_2() {
  model::Model model({}, with_steps(10));
  model.set_undo_rule(model::UndoRule::per_user_oldest_first);
  std::vector<LogRecord> records;
  const auto must = [&](const v1::Operation& operation) {
    const auto submitted = model.submit(operation);
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
    records.push_back(make_record(*submitted, 1, 0));
  };
  for (int i = 0; i < 4; ++i) must(create(ann, fmt::format("a{}", i)));
  for (int i = 0; i < 8; ++i) must(create(script, fmt::format("s{}", i)));
  for (int i = 0; i < 8; ++i) must(undo(script));
  return records;
}

TEST_F(Forgetting, D8U1_ALogOfFormat2ReplaysAsItForgot) {
  const model::ApplyContext context = with_steps(10);
  const std::vector<LogRecord> records = by_format_2();
  ASSERT_EQ(records.size(), 20U);
  {
    auto log = OperationLog::create(path, new_identity(1));
    ASSERT_TRUE(log->append(records).ok());
  }
  // By the rule of now it cannot be replayed: so the file must say which it was.
  {
    auto log = OperationLog::open(path, Access::read);
    EXPECT_EQ(log->rules().fair_from, 1U);
    EXPECT_FALSE(recover(*log, context).ok());
  }
  make_format_2(path);
  auto log = OperationLog::open(path, Access::read);
  ASSERT_TRUE(log.ok());
  EXPECT_TRUE(check_log(*log).good());
  EXPECT_EQ(log->rules().per_user_from, 1U);
  EXPECT_EQ(log->rules().fair_from, 21U);
  auto recovered = recover(*log, context);
  ASSERT_TRUE(recovered.ok()) << recovered.error().describe();
  EXPECT_EQ(recovered->model.document().entities.size(), 4U);
  EXPECT_EQ(recovered->model.history().undo_steps(ann), 2U);
}

TEST_F(Forgetting, D6D8U1_WorkOnALogOfFormat2GoesOnByThePresentRule) {
  const model::ApplyContext context = with_steps(10);
  {
    auto log = OperationLog::create(path, new_identity(1));
    ASSERT_TRUE(log->append(by_format_2()).ok());
  }
  make_format_2(path);
  std::string hash;
  {
    auto opened = ModelStore::open(path, context, options(5, 4));
    ASSERT_TRUE(opened.ok()) << opened.error().describe();
    model::Model& model = opened->model;
    for (int i = 0; i < 7; ++i) ASSERT_TRUE(model.submit(create(bob, fmt::format("b{}", i))).ok());
    EXPECT_EQ(model.history().undo_steps(ann) + model.history().redo_steps(script), 3U)
        << "those of before give way first, the oldest first";
    EXPECT_EQ(model.history().undo_steps(bob), 7U);
    for (int i = 0; i < 12; ++i) ASSERT_TRUE(model.submit(create(script, fmt::format("t{}", i))).ok());
    EXPECT_EQ(model.history().undo_steps(ann), 0U);
    EXPECT_EQ(model.history().undo_steps(bob), 5U);
    EXPECT_EQ(model.history().undo_steps(script), 5U);
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(model.submit(undo(bob)).ok());
    hash = model::document_hash(model.document());
    opened->store->stop();
  }
  auto log = OperationLog::open(path, Access::write);
  ASSERT_TRUE(log.ok()) << log.error().describe();
  EXPECT_EQ(log->rules().fair_from, 21U);
  EXPECT_EQ(log->database().integer("PRAGMA user_version").value(), 3);
  const fs::path to = fs::path(folder.path()) / "repaired.handloft";
  ASSERT_TRUE(repair(path, to).ok());
  auto copy = OperationLog::open(to, Access::read);
  EXPECT_EQ(copy->rules().fair_from, 21U);
  for (const OperationLog* const each : {&*log, &*copy}) {
    for (const auto snapshots : {RecoveryOptions::Snapshots::used, RecoveryOptions::Snapshots::ignored}) {
      RecoveryOptions from;
      from.snapshots = snapshots;
      auto recovered = recover(*each, context, from);
      ASSERT_TRUE(recovered.ok()) << recovered.error().describe();
      EXPECT_EQ(model::document_hash(recovered->model.document()), hash);
    }
  }
}

TEST_F(Forgetting, D4_WhereTheRuleBeginsCannotRotUnseen) {
  {
    auto log = OperationLog::create(path, new_identity(1));
    ASSERT_TRUE(log->append(by_format_2()).ok());
    ASSERT_TRUE(log->database().execute("UPDATE rules SET fair_from = 3").ok());
  }
  auto log = OperationLog::open(path, Access::write);
  ASSERT_FALSE(log.ok());
  EXPECT_EQ(log.error().code, ErrorCode::data_corrupt);
  EXPECT_NE(log.error().message.find("rules"), std::string::npos) << log.error().message;
}

}  // namespace
}  // namespace handloft::store
