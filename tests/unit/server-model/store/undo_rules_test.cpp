// Which rules of undo a log was written by (U1, D6, D8). Files of format 1 say nothing of it: those from
// before protocol 1.2 had one history for all clients, and must replay as they were. Those of format 2 forgot
// the oldest step of all where a history was full.

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/store/log_check.h"
#include "server-model/store/model_store.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "server-model/store/repair.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/store/client_operations.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;
using Access = OperationLog::Access;

using test::ann, test::bob, test::create, test::undo;

v1::Operation redo(std::uint64_t client) {
  v1::Operation operation;
  operation.set_client_id(client);
  operation.mutable_redo();
  return operation;
}

enum class Did : std::uint8_t { created, removed };

/// As a program wrote it, whatever this one would make of it.
LogRecord record(std::uint64_t sequence, const v1::Operation& operation, Did did, const std::string& id) {
  model::Submitted submitted;
  submitted.sequence = sequence;
  submitted.effective = operation;
  (did == Did::created ? submitted.changes.created : submitted.changes.removed) = {id};
  return make_record(submitted, 1, 0);
}

/// Ann makes a, Bob b, and Ann takes back the newest: Bob's b. Bob does it again, and takes it back.
std::vector<LogRecord> by_the_shared_rule() {
  return {record(1, create(ann, "a"), Did::created, "a"), record(2, create(bob, "b"), Did::created, "b"),
          record(3, undo(ann), Did::removed, "b"),        record(4, redo(bob), Did::created, "b"),
          record(5, undo(bob), Did::removed, "b"),        record(6, undo(bob), Did::removed, "a"),
          record(7, redo(bob), Did::created, "a")};
}

/// The same wishes, each for one's own.
std::vector<LogRecord> by_the_rule_per_user() {
  return {record(1, create(ann, "a"), Did::created, "a"), record(2, create(bob, "b"), Did::created, "b"),
          record(3, undo(ann), Did::removed, "a"), record(4, redo(ann), Did::created, "a"),
          record(5, undo(ann), Did::removed, "a")};
}

class UndoRules : public testing::Test {
 protected:
  /// A file as programs of format 1 left it: with no word of rules, and with the two tables that were never
  /// filled.
  void write_format_1(const std::vector<LogRecord>& records) {
    auto log = OperationLog::create(path, new_identity(1));
    ASSERT_TRUE(log.ok()) << log.error().describe();
    ASSERT_TRUE(log->append(records).ok());
    for (const char* sql :
         {"DROP TABLE rules", "CREATE TABLE branches (id INTEGER PRIMARY KEY, name TEXT) STRICT",
          "CREATE TABLE versions (name TEXT PRIMARY KEY) STRICT", "INSERT INTO branches VALUES (1, 'main')",
          "PRAGMA user_version=1"}) {
      ASSERT_TRUE(log->database().execute(sql).ok()) << sql;
    }
  }
  std::vector<std::string> entities() const {
    auto log = OperationLog::open(path, Access::read);
    EXPECT_TRUE(log.ok());
    auto recovered = recover(*log);
    EXPECT_TRUE(recovered.ok()) << (recovered ? "" : recovered.error().describe());
    return recovered ? ids(recovered->model.document()) : std::vector<std::string>();
  }
  static std::vector<std::string> ids(const model::Document& document) {
    std::vector<std::string> all;
    for (const auto& [id, entity] : document.entities) all.push_back(id);
    return all;
  }
  std::int64_t format() const {
    auto log = OperationLog::open(path, Access::read);
    return log->database().integer("PRAGMA user_version").value();
  }
  std::string bytes() const {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  using Ids = std::vector<std::string>;
  handloft::test::TemporaryDirectory folder;
  const fs::path path = fs::path(folder.path()) / "old.handloft";
};

TEST_F(UndoRules, D8U1AnOldLogOfSeveralClientsReplaysWithOneHistoryForAll) {
  write_format_1(by_the_shared_rule());
  const std::string before = bytes();
  EXPECT_EQ(entities(), (Ids{"a"}));
  auto log = OperationLog::open(path, Access::read);
  EXPECT_EQ(log->rules().per_user_from, 8U);
  EXPECT_TRUE(check_log(*log).good());
  // At each moment of it.
  const std::vector<Ids> moments{{}, {"a"}, {"a", "b"}, {"a"}, {"a", "b"}, {"a"}, {}, {"a"}};
  for (std::uint64_t until = 0; until < moments.size(); ++until) {
    RecoveryOptions options;
    options.until = until;
    EXPECT_EQ(ids(recover(*log, {}, options)->model.document()), moments[until]) << until;
  }
  EXPECT_EQ(bytes(), before) << "looking writes nothing";
}

TEST_F(UndoRules, U1AFileWithoutAWordThatWasWrittenPerUserReplaysPerUser) {
  write_format_1(by_the_rule_per_user());
  EXPECT_EQ(entities(), (Ids{"b"}));
}

TEST_F(UndoRules, U1ThePresentFormatSaysThatUndoIsPerUser) {
  {
    auto log = OperationLog::create(path, new_identity(1));
    ASSERT_TRUE(log->append(by_the_rule_per_user()).ok());
  }
  EXPECT_EQ(format(), 3);
  EXPECT_EQ(entities(), (Ids{"b"}));
  // What the answers say is no matter then: the same operations with those of the other rule.
  fs::remove(path);
  fs::remove(AckMark::path_of(path));
  std::vector<LogRecord> records = by_the_shared_rule();
  records.resize(3);
  {
    auto log = OperationLog::create(path, new_identity(1));
    ASSERT_TRUE(log->append(records).ok());
  }
  EXPECT_EQ(entities(), (Ids{"b"}));
}

TEST_F(UndoRules, D6D8U1WorkOnAnOldLogGoesOnPerUserAndReplaysAsItWasDone) {
  write_format_1(by_the_shared_rule());
  std::string hash;
  {
    auto opened = ModelStore::open(path, {});
    ASSERT_TRUE(opened.ok()) << opened.error().describe();
    opened->store->flush();
    EXPECT_EQ(format(), 1) << "opening writes nothing";
    // Bob can still do his b again: it was taken back when one history was for all.
    ASSERT_TRUE(opened->model.submit(create(bob, "c")).ok());
    ASSERT_TRUE(opened->model.submit(create(ann, "d")).ok());
    ASSERT_TRUE(opened->model.submit(undo(bob)).ok());
    EXPECT_EQ(ids(opened->model.document()), (Ids{"a", "d"})) << "his own c, not Ann's newer d";
    ASSERT_TRUE(opened->model.submit(undo(ann)).ok());
    ASSERT_TRUE(opened->model.submit(undo(ann)).ok());
    ASSERT_TRUE(opened->model.submit(redo(bob)).ok());
    EXPECT_EQ(ids(opened->model.document()), (Ids{"c"}));
    hash = model::document_hash(opened->model.document());
    opened->store->stop();
  }
  EXPECT_EQ(format(), 3);
  auto log = OperationLog::open(path, Access::write);
  ASSERT_TRUE(log.ok()) << log.error().describe();
  EXPECT_EQ(log->rules().per_user_from, 8U);
  EXPECT_EQ(model::document_hash(recover(*log)->model.document()), hash);
  // A copy of what is good keeps the border.
  const fs::path to = fs::path(folder.path()) / "repaired.handloft";
  ASSERT_TRUE(repair(path, to).ok());
  auto repaired = OperationLog::open(to, Access::read);
  EXPECT_EQ(repaired->rules().per_user_from, 8U);
  EXPECT_EQ(model::document_hash(recover(*repaired)->model.document()), hash);
}

TEST_F(UndoRules, D4ARuleThatHasRottedIsNamed) {
  {
    auto log = OperationLog::create(path, new_identity(1));
    ASSERT_TRUE(log->append(by_the_rule_per_user()).ok());
    ASSERT_TRUE(log->database().execute("UPDATE rules SET per_user_from = 3").ok());
  }
  auto log = OperationLog::open(path, Access::write);
  ASSERT_FALSE(log.ok());
  EXPECT_EQ(log.error().code, ErrorCode::data_corrupt);
  EXPECT_NE(log.error().message.find("rules"), std::string::npos) << log.error().message;
}

TEST_F(UndoRules, D4AnOperationAtAPlaceWhereNoneCanBeIsNamed) {
  {
    auto log = OperationLog::create(path, new_identity(1));
    ASSERT_TRUE(log->append(by_the_rule_per_user()).ok());
    ASSERT_TRUE(log->database()
                    .execute("UPDATE operations SET place = place + (1 << 50) WHERE (place & 0xffff) = 5")
                    .ok());
  }
  fs::remove(path.string() + "-mark");
  auto log = OperationLog::open(path, Access::write);
  ASSERT_FALSE(log.ok());
  EXPECT_EQ(log.error().code, ErrorCode::data_corrupt);
}

}  // namespace
}  // namespace handloft::store
