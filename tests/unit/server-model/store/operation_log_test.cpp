// The durable log: what goes in comes out, in order, once, and durable (U5, H3); both rules of undo (U1);
// two writers, newer files and files of others are refused in words.

#include "server-model/store/operation_log.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <span>
#include <string>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/store/backup.h"
#include "server-model/store/group_commit.h"
#include "server-model/store/log_check.h"
#include "server-model/store/model_store.h"
#include "server-model/store/recovery.h"
#include "server-model/store/repair.h"
#include "server-model/store/snapshot.h"
#include "tests/support/stored_session.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
using Access = OperationLog::Access;

const test::StoredSession& session() {
  static const test::StoredSession one = test::stored_session(200, 7);
  return one;
}

class Store : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "handloft-store-XXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder = pattern;
    path = folder / "model.handloft";
  }
  void TearDown() override { fs::remove_all(folder); }

  OperationLog create() {
    auto log = OperationLog::create(path, new_identity(1));
    EXPECT_TRUE(log.ok()) << log.error().describe();
    return *std::move(log);
  }
  void write_all(OperationLog& log) {
    auto status = log.append(session().records);
    ASSERT_TRUE(status.ok()) << status.error().describe();
  }
  static std::string hash_of(const Recovered& recovered) {
    return model::document_hash(recovered.model.document());
  }

  fs::path folder, path;
};

TEST_F(Store, WhatWasAppendedIsThereAfterReopening) {
  {
    OperationLog log = create();
    write_all(log);
  }
  auto log = OperationLog::open(path, Access::write);
  ASSERT_TRUE(log.ok()) << log.error().describe();
  EXPECT_EQ(log->last_sequence(), 200U);
  std::size_t i = 0;
  ASSERT_TRUE(log->read(1,
                        [&](const LogEntry& entry) -> Status {
                          const LogRecord& expected = session().records[i++];
                          EXPECT_EQ(entry.record.sequence, i);
                          EXPECT_EQ(entry.record.operation, expected.operation);
                          EXPECT_EQ(entry.record.answer, expected.answer);
                          EXPECT_EQ(entry.record.client_id, expected.client_id);
                          EXPECT_EQ(entry.record.time_ns, expected.time_ns);
                          return {};
                        })
                  .ok());
  EXPECT_EQ(i, 200U);
  EXPECT_EQ(*log->next_epoch(), 2U);
  EXPECT_EQ(*log->last_client_id(), 3U);
}

TEST_F(Store, D6AReplayGivesTheHashThatTheModelHad) {
  OperationLog log = create();
  write_all(log);
  const auto recovered = recover(log);
  ASSERT_TRUE(recovered.ok()) << recovered.error().describe();
  EXPECT_EQ(recovered->replayed, 200U);
  EXPECT_EQ(hash_of(*recovered), session().hashes.back());
  RecoveryOptions earlier;
  earlier.until = 57;
  EXPECT_EQ(hash_of(*recover(log, {}, earlier)), session().hashes[57]);
}

TEST_F(Store, ASnapshotAndTheTailGiveTheSameAndCanBeUndoneAsDeep) {
  OperationLog log = create();
  write_all(log);
  auto prepared = prepare_snapshot(session().middle);
  ASSERT_TRUE(prepared.ok()) << prepared.error().describe();
  ASSERT_TRUE(write_snapshot(log, *prepared, 5).ok());
  auto recovered = recover(log);
  ASSERT_TRUE(recovered.ok());
  EXPECT_EQ(recovered->snapshot_sequence, 100U);
  EXPECT_EQ(recovered->replayed, 100U);
  EXPECT_EQ(hash_of(*recovered), session().hashes.back());
  RecoveryOptions all;
  all.snapshots = RecoveryOptions::Snapshots::ignored;
  auto replayed = recover(log, {}, all);
  ASSERT_TRUE(replayed.ok());
  v1::Operation undo;
  undo.mutable_undo();
  std::size_t undone = 0;
  // Each of the three clients' own steps (U1), until none of them may go on.
  for (std::uint64_t refused = 0, client = 1; refused < 3; client = client % 3 + 1) {
    undo.set_client_id(client);
    const bool done = replayed->model.submit(undo).ok();
    ASSERT_EQ(recovered->model.submit(undo).ok(), done) << undone;
    ASSERT_EQ(hash_of(*recovered), hash_of(*replayed)) << undone;
    refused = done ? 0 : refused + 1;
    if (done) ++undone;
  }
  EXPECT_GT(undone, 20U);
}

TEST_F(Store, AnUndoDeeperThanTheSnapshotRemembersComesFromAnOlderOne) {
  OperationLog log = create();
  write_all(log);
  model::EncodeOptions shallow;
  shallow.max_steps = 0;
  ASSERT_TRUE(write_snapshot(log, *prepare_snapshot(session().middle, shallow), 5).ok());
  const auto recovered = recover(log);
  ASSERT_TRUE(recovered.ok()) << recovered.error().describe();
  EXPECT_EQ(hash_of(*recovered), session().hashes.back());
}

TEST_F(Store, TheSnapshotBeforeIsKeptAndTakesOver) {
  OperationLog log = create();
  write_all(log);
  ASSERT_TRUE(write_snapshot(log, *prepare_snapshot(session().middle), 5).ok());
  const auto end = recover(log);
  for (int i = 0; i < 2; ++i) {
    const model::StoredState state{end->model.history(), end->model.sequence()};
    ASSERT_TRUE(write_snapshot(log, *prepare_snapshot(state), 6).ok());
  }
  ASSERT_EQ(log.snapshots()->size(), 2U);
  ASSERT_TRUE(write_snapshot(log, *prepare_snapshot(session().middle), 7).ok());
  ASSERT_EQ(log.snapshots()->at(0).sequence, 100U);
  ASSERT_TRUE(log.database().execute("UPDATE snapshots SET manifest = x'00' WHERE sequence = 100").ok());
  EXPECT_EQ(check_log(log).bad_snapshots.size(), 1U);
  const auto recovered = recover(log);
  ASSERT_TRUE(recovered.ok());
  EXPECT_EQ(recovered->snapshot_sequence, 200U);
  EXPECT_EQ(hash_of(*recovered), session().hashes.back());
}

TEST_F(Store, H3ARetriedOperationGetsItsOldAnswerAlsoAfterARestart) {
  OperationLog log = create();
  write_all(log);
  ASSERT_TRUE(write_snapshot(log, *prepare_snapshot(session().middle), 5).ok());
  auto recovered = recover(log);
  ASSERT_TRUE(recovered.ok());
  std::size_t asked = 0;
  for (const LogRecord& record : session().records) {
    if (record.client_op_id == 0) continue;
    v1::Operation operation;
    operation.ParseFromString(record.operation);
    const auto again = recovered->model.submit(operation);
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->sequence, record.sequence);
    EXPECT_EQ(again->changes.all(), answer_of(record).changes.all());
    const auto found = log.find(record.client_id, record.client_op_id);
    ASSERT_TRUE(found.ok() && *found);
    EXPECT_EQ((*found)->record.sequence, record.sequence);
    ++asked;
  }
  EXPECT_GT(asked, 30U);
  EXPECT_EQ(recovered->model.sequence(), 200U);
  EXPECT_FALSE(*log.find(99, 1));
  // And the log itself takes none twice.
  LogRecord twice = session().records.front();
  twice.client_id = 77;
  twice.client_op_id = 1;
  twice.sequence = 201;
  ASSERT_TRUE(log.append({&twice, 1}).ok());
  twice.sequence = 202;
  EXPECT_EQ(log.append({&twice, 1}).error().code, ErrorCode::already_exists);
  EXPECT_TRUE(log.failure().ok());
  EXPECT_EQ(log.last_sequence(), 201U);
}

TEST_F(Store, AGapInTheSequenceIsRefused) {
  OperationLog log = create();
  EXPECT_EQ(log.append({&session().records[1], 1}).error().field, "sequence");
  EXPECT_TRUE(log.append({&session().records[0], 1}).ok());
}

// Found by fuzzing the access file, which uses the same statements.
TEST_F(Store, D4ATableThatADamagedFileLacksIsAnError) {
  OperationLog log = create();
  Statement none = log.database().prepare("INSERT INTO nowhere VALUES (?1)");
  EXPECT_FALSE(none.good());
  EXPECT_FALSE(none.bind(1, std::int64_t{1}).run());
  none.reset();
  EXPECT_EQ(none.step(), Statement::Step::failed);
  ASSERT_TRUE(log.database().execute("DROP TABLE audit").ok());
  EXPECT_FALSE(log.add_audit({1, 2, "join", "Ada joined"}).ok());
}

TEST_F(Store, TheAuditTrailIsChained) {
  OperationLog log = create();
  for (const char* words : {"Ada joined", "Bob refused", "Ada left"})
    ASSERT_TRUE(log.add_audit({1, 2, "join", words}).ok());
  EXPECT_EQ(log.audit()->size(), 3U);
  ASSERT_TRUE(log.database().execute("DELETE FROM audit WHERE id = 2").ok());
  EXPECT_EQ(log.audit().error().code, ErrorCode::data_corrupt);
}

TEST_F(Store, DamageIsNamedNeverWrittenOverAndRepairedBeside) {
  {
    OperationLog log = create();
    write_all(log);
    ASSERT_TRUE(log.database()
                    .execute("UPDATE operations SET client_id = client_id + 1 WHERE (place & 0xffff) = 120")
                    .ok());
  }
  const auto bytes = [&] {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string before = bytes();
  const auto refused = OperationLog::open(path, Access::write);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::data_corrupt);
  EXPECT_NE(refused.error().message.find("operation 120"), std::string::npos) << refused.error().message;
  const auto repaired = repair(path, folder / "repaired.handloft");
  ASSERT_TRUE(repaired.ok()) << repaired.error().describe();
  EXPECT_EQ(repaired->operations, 119U);
  EXPECT_EQ(bytes(), before);
  auto log = OperationLog::open(folder / "repaired.handloft", Access::write);
  ASSERT_TRUE(log.ok()) << log.error().describe();
  EXPECT_EQ(hash_of(*recover(*log)), session().hashes[119]);
}

// As a copy over a line that broke, or a disk that lost the end: SQLite opens no such file.
TEST_F(Store, OfAFileThatWasCutOffTheBeginningIsRepaired) {
  {
    OperationLog log = create();
    write_all(log);
    ASSERT_TRUE(log.database().checkpoint().ok());
  }
  fs::remove(path.string() + "-wal");
  const auto whole = fs::file_size(path);
  const fs::path cut = folder / "cut.handloft";
  const fs::path to = folder / "repaired.handloft";
  std::uint64_t before = 0;
  std::uint64_t operations = 0;
  for (const std::uintmax_t percent : {1U, 40U, 60U, 80U, 99U}) {
    for (const char* rest : {"", "-mark", "-wal", "-shm"}) {
      fs::remove(to.string() + rest);
      fs::remove(cut.string() + rest);
    }
    fs::copy_file(path, cut);
    fs::copy_file(path.string() + "-mark", cut.string() + "-mark");
    fs::resize_file(cut, whole * percent / 100);
    const auto repaired = repair(cut, to);
    EXPECT_EQ(fs::file_size(cut), whole * percent / 100);
    if (!repaired) {
      // The tables' beginnings alone take 10 of 21 pages.
      EXPECT_LT(percent, 50U) << repaired.error().describe();
      EXPECT_EQ(repaired.error().code, ErrorCode::data_corrupt);
      EXPECT_FALSE(fs::exists(to));
      continue;
    }
    operations = repaired->operations;
    ASSERT_LT(operations, 200U);
    ASSERT_FALSE(repaired->damages.empty());
    EXPECT_GE(operations, before) << percent;
    before = operations;
    auto log = OperationLog::open(to, Access::write);
    ASSERT_TRUE(log.ok()) << log.error().describe();
    EXPECT_TRUE(check_log(*log).good());
    EXPECT_EQ(hash_of(*recover(*log)), session().hashes[operations]) << percent;
  }
  EXPECT_GT(operations, 180U);
}

TEST_F(Store, SwappedAndMissingRecordsShow) {
  for (const char* sql : {"DELETE FROM operations WHERE (place & 0xffff) = 120",
                          "UPDATE operations SET place = place + 100000 WHERE (place & 0xffff) = 200"}) {
    fs::remove(path);
    fs::remove(AckMark::path_of(path));
    {
      OperationLog log = create();
      write_all(log);
      ASSERT_TRUE(log.database().execute(sql).ok());
    }
    EXPECT_EQ(OperationLog::open(path, Access::write).error().code, ErrorCode::data_corrupt) << sql;
  }
}

TEST_F(Store, ALostEndShowsByItsMark) {
  fs::path copy = folder / "copy.handloft";
  OperationLog log = create();
  write_all(log);
  // As a crash leaves it, but without the write-ahead log that holds the operations.
  fs::copy_file(path, copy);
  fs::copy_file(path.string() + "-mark", copy.string() + "-mark");
  const auto opened = OperationLog::open(copy, Access::write);
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("operation 200 was saved"), std::string::npos)
      << opened.error().message;
}

// By whoever tidies up a folder while the server writes there: nothing more may be called saved.
TEST_F(Store, D1NothingIsSavedInAFileThatWasRemovedOrMoved) {
  const std::span<const LogRecord> all(session().records);
  for (const bool removed : {true, false}) {
    path = folder / (removed ? "removed.handloft" : "moved.handloft");
    OperationLog log = create();
    ASSERT_TRUE(log.append(all.first(10)).ok());
    if (removed) {
      fs::remove(path);
    } else {
      fs::rename(path, folder / "elsewhere.handloft");
    }
    const Status refused = log.append(all.subspan(10, 1));
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::io);
    EXPECT_NE(refused.error().message.find("removed or moved"), std::string::npos)
        << refused.error().describe();
    EXPECT_EQ(log.append(all.subspan(10, 1)).error().message, refused.error().message) << "for good";
    EXPECT_EQ(log.last_sequence(), 10U);
  }
}

// Roles are checked by the server; who may read the file needs none (U2).
TEST_F(Store, U2FilesAreTheirOwnersAlone) {
  OperationLog log = create();
  write_all(log);
  ASSERT_TRUE(back_up(path, folder / "copy.handloft").ok());
  ASSERT_TRUE(repair(path, folder / "repaired.handloft").ok());
  for (const char* name : {"model.handloft", "model.handloft-wal", "model.handloft-shm",
                           "model.handloft-mark", "copy.handloft", "repaired.handloft"}) {
    ASSERT_TRUE(fs::exists(folder / name)) << name;
    EXPECT_EQ(fs::status(folder / name).permissions(), fs::perms::owner_read | fs::perms::owner_write)
        << name;
  }
}

// A copy in its place would be the last good one's end.
TEST_F(Store, D4ABackupOfAFileThatLacksWhatWasSavedIsRefused) {
  {
    OperationLog log = create();
    write_all(log);
    const fs::path crashed = folder / "crashed.handloft";
    fs::copy_file(path, crashed);
    fs::copy_file(path.string() + "-mark", crashed.string() + "-mark");
  }
  const auto refused = back_up(folder / "crashed.handloft", folder / "copy.handloft");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::data_corrupt);
  EXPECT_NE(refused.error().message.find("operation 200 was saved"), std::string::npos)
      << refused.error().describe();
  EXPECT_FALSE(fs::exists(folder / "copy.handloft"));
  const auto good = back_up(path, folder / "copy.handloft");
  ASSERT_TRUE(good.ok()) << good.error().describe();
  EXPECT_EQ(good->operations, 200U);
}

TEST_F(Store, ABackupTouchesNothingThatSomebodyElseMayMean) {
  OperationLog log = create();
  write_all(log);
  std::ofstream(folder / "copy.handloft.part") << "precious";
  ASSERT_TRUE(back_up(path, folder / "copy.handloft").ok());
  std::ifstream in(folder / "copy.handloft.part");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "precious");
  EXPECT_FALSE(back_up(path, folder / "copy.handloft").ok()) << "never one that is there";
  for (const auto& each : fs::directory_iterator(folder)) {
    EXPECT_EQ(each.path().filename().string().find("part-"), std::string::npos) << each.path();
  }
}

TEST_F(Store, D1AFileThatIsEmptyOrGoneIsNotBegunAnewWhileItsMarkKnowsOfOperations) {
  {
    OperationLog log = create();
    write_all(log);
  }
  const auto refused = [&] {
    const auto opened = ModelStore::open(path, {});
    EXPECT_FALSE(opened.ok());
    if (opened.ok()) return;
    EXPECT_EQ(opened.error().code, ErrorCode::data_corrupt) << opened.error().describe();
    EXPECT_NE(opened.error().message.find("200 operations"), std::string::npos) << opened.error().describe();
    EXPECT_EQ(AckMark::read(path)->sequence, 200U);
  };
  fs::resize_file(path, 0);
  refused();
  EXPECT_EQ(OperationLog::open(path, Access::read).error().code, ErrorCode::data_corrupt);
  fs::remove(path);
  refused();
  EXPECT_FALSE(fs::exists(path)) << "nothing is made in its place";
  fs::remove(AckMark::path_of(path));
  EXPECT_TRUE(ModelStore::open(path, {}).ok());
}

TEST_F(Store, OneFileIsOneFileByWhateverLink) {
  const fs::path link = folder / "link.handloft", second = folder / "second.handloft";
  {
    OperationLog log = create();
    write_all(log);
    fs::create_symlink(path, link);
    const auto other = OperationLog::open(link, Access::write);
    ASSERT_FALSE(other.ok());
    EXPECT_NE(other.error().message.find("in use by another"), std::string::npos) << other.error().describe();
  }
  EXPECT_EQ(OperationLog::open(link, Access::write)->last_sequence(), 200U);
  fs::create_hard_link(path, second);
  for (const fs::path& name : {path, second}) {
    const auto opened = OperationLog::open(name, Access::write);
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::failed_precondition);
    EXPECT_NE(opened.error().message.find("hard links"), std::string::npos) << opened.error().describe();
    EXPECT_FALSE(ModelStore::open(name, {}).ok());
  }
  EXPECT_EQ(OperationLog::open(path, Access::read)->last_sequence(), 200U);
  fs::remove(second);
  EXPECT_EQ(OperationLog::open(path, Access::write)->last_sequence(), 200U);
}

// As from a medium that is read-only, or somebody else's folder.
TEST_F(Store, AFileCanBeReadWhereNothingCanBeWritten) {
  path = folder / "100% #1?.handloft";
  {
    OperationLog log = create();
    write_all(log);
  }
  for (const char* beside : {"-wal", "-shm"}) ASSERT_FALSE(fs::exists(path.string() + beside));
  fs::permissions(folder, fs::perms(0555));
  fs::permissions(path, fs::perms(0444));
  const auto in_a_child = [&](const std::function<bool()>& holds) {
    const pid_t child = ::fork();
    if (child == 0) {
      constexpr uid_t nobody = 65534;
      if (::geteuid() == 0 && ::setresuid(nobody, nobody, nobody) != 0) ::_exit(2);
      ::_exit(holds() ? 0 : 1);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  EXPECT_EQ(in_a_child([&] {
              const auto log = OperationLog::open(path, Access::read);
              return log.ok() && log->last_sequence() == 200 && check_log(*log).good();
            }),
            0);
  fs::permissions(path, fs::perms(0000));
  EXPECT_EQ(in_a_child([&] {
              const auto log = OperationLog::open(path, Access::read);
              return !log.ok() && log.error().code == ErrorCode::permission_denied;
            }),
            0);
  fs::permissions(folder, fs::perms(0755));
}

TEST_F(Store, TwoWritersAreRefusedReadersAreNot) {
  OperationLog log = create();
  write_all(log);
  const auto second = OperationLog::open(path, Access::write);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("in use by another"), std::string::npos);
  auto reader = OperationLog::open(path, Access::read);
  ASSERT_TRUE(reader.ok()) << reader.error().describe();
  EXPECT_EQ(reader->last_sequence(), 200U);
  EXPECT_TRUE(check_log(*reader).good());
  EXPECT_FALSE(reader->append({&session().records[0], 1}).ok());
}

TEST_F(Store, FilesOfOthersAndOfTheFutureAreRefusedInWords) {
  EXPECT_EQ(OperationLog::open(path, Access::read).error().code, ErrorCode::not_found);
  std::ofstream(path) << "This is a letter, and long enough for a database page or two."
                      << std::string(5000, 'x');
  EXPECT_FALSE(OperationLog::open(path, Access::write).ok());
  fs::remove(path);
  std::ofstream(path).close();
  EXPECT_EQ(OperationLog::open(path, Access::write).error().code, ErrorCode::failed_precondition);
  fs::remove(path);
  { OperationLog log = create(); }
  EXPECT_EQ(OperationLog::create(path, new_identity(1)).error().code, ErrorCode::already_exists);
  {
    auto log = OperationLog::open(path, Access::write);
    ASSERT_TRUE(log->database().execute("PRAGMA user_version=4").ok());
  }
  const auto newer = OperationLog::open(path, Access::write);
  ASSERT_FALSE(newer.ok());
  EXPECT_EQ(newer.error().code, ErrorCode::unsupported);
  EXPECT_NE(newer.error().message.find("newer Handloft"), std::string::npos);
}

TEST_F(Store, GroupCommitTellsInOrderWhenRecordsAreDurable) {
  std::vector<std::uint64_t> told;
  {
    GroupCommit commit(create());
    for (const LogRecord& record : session().records) {
      ASSERT_TRUE(commit.accepting());
      commit.append(record, [&, sequence = record.sequence](const Status& status) {
        EXPECT_TRUE(status.ok());
        told.push_back(sequence);
      });
    }
    std::promise<Status> written;
    commit.snapshot(*prepare_snapshot(session().middle), 5,
                    [&](const Status& status) { written.set_value(status); });
    EXPECT_TRUE(written.get_future().get().ok());
    commit.flush();
    EXPECT_EQ(told.size(), 200U);
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_LE(commit.statistics().commits, 200U);
    EXPECT_EQ(commit.statistics().records, 200U);
    commit.stop();
    bool refused = false;
    commit.append(session().records[0], [&](const Status& status) { refused = !status.ok(); });
    EXPECT_TRUE(refused);
    EXPECT_FALSE(commit.accepting());
  }
  auto log = OperationLog::open(path, Access::write);
  ASSERT_TRUE(log.ok());
  const auto recovered = recover(*log);
  EXPECT_EQ(recovered->snapshot_sequence, 100U);
  EXPECT_EQ(hash_of(*recovered), session().hashes.back());
}

}  // namespace
}  // namespace handloft::store
