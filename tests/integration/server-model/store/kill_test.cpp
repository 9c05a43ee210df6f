// D1: a process that writes the log is killed (SIGKILL) at any moment, again and again over the same file;
// what it had acknowledged is there each time, and nothing that it did not write. HANDLOFT_LONG=1: 2,000
// times instead of 100.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <random>
#include <string>
#include <thread>

#include "server-model/model/canonical.h"
#include "server-model/store/group_commit.h"
#include "server-model/store/log_check.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "server-model/store/snapshot.h"
#include "tests/support/build_kind.h"
#include "tests/support/stored_session.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
using Access = OperationLog::Access;

/// Sizes from some bytes to several pages.
LogRecord record_at(std::uint64_t sequence) {
  LogRecord record;
  record.epoch = 1;
  record.sequence = sequence;
  record.client_id = 1 + sequence % 5;
  record.client_op_id = sequence % 3 == 0 ? sequence : 0;
  record.time_ns = static_cast<std::int64_t>(sequence);
  record.operation = std::string((sequence * 7919) % 9000, static_cast<char>('a' + sequence % 26));
  record.answer = "answer " + std::to_string(sequence);
  return record;
}

/// The child: appends until it is killed, and tells each sequence number when it is durable.
[[noreturn]] void write_until_killed(const fs::path& path, int tell) {
  auto log = fs::exists(path) ? OperationLog::open(path, Access::write)
                              : OperationLog::create(path, LogIdentity{{9}, 1});
  if (!log) {
    // Killed while the file was made: made again.
    if (log.error().code == ErrorCode::failed_precondition)
      log = OperationLog::create(path, LogIdentity{{9}, 1});
    if (!log) ::_exit(3);
  }
  std::uint64_t sequence = log->last_sequence();
  GroupCommit commit(*std::move(log));
  const auto snapshot = prepare_snapshot(test::stored_session(30, 1).middle);
  for (;;) {
    while (!commit.accepting()) std::this_thread::yield();
    ++sequence;
    commit.append(record_at(sequence), [tell, sequence](const Status& status) {
      if (!status || ::write(tell, &sequence, sizeof sequence) != sizeof sequence) ::_exit(4);
    });
    if (sequence % 16 == 0) commit.flush();
    if (sequence % 64 == 0) commit.snapshot(*snapshot, 1, {});
  }
}

TEST(StoreKill, D1NothingAcknowledgedIsLostWhenTheWriterIsKilled) {
  std::string folder = testing::TempDir() + "handloft-kill-XXXXXX";
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  const fs::path path = fs::path(folder) / "model.handloft";
  std::random_device entropy;
  const std::uint64_t seed = entropy();
  std::mt19937_64 random(seed);
  std::uint64_t acknowledged = 0, more = 0;
  const int loops = std::getenv("HANDLOFT_LONG") != nullptr ? 2000 : test::sanitized ? 30 : 100;
  int loop = 0;
  for (; loop < loops && !HasFailure(); ++loop) {
    // A file of thousands of records takes longer to check than to write: begin anew now and then.
    if (loop % 50 == 49) {
      for (const char* suffix : {"", "-wal", "-shm", "-mark"}) fs::remove(path.string() + suffix);
      acknowledged = 0;
    }
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      ::close(ends[0]);
      write_until_killed(path, ends[1]);
    }
    ::close(ends[1]);
    const std::uint64_t wanted = random() % 40;
    std::uint64_t got = 0;
    for (std::uint64_t sequence = 0;
         got < wanted && ::read(ends[0], &sequence, sizeof sequence) == sizeof sequence; ++got) {
      acknowledged = sequence;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself: " << WEXITSTATUS(status);
    for (std::uint64_t sequence = 0; ::read(ends[0], &sequence, sizeof sequence) == sizeof sequence;)
      acknowledged = sequence;
    ::close(ends[0]);

    auto log = OperationLog::open(path, Access::write);
    if (!log && acknowledged == 0) continue;
    ASSERT_TRUE(log.ok()) << log.error().describe();
    ASSERT_GE(log->last_sequence(), acknowledged);
    more += log->last_sequence() - acknowledged;
    ASSERT_TRUE(log->read(1,
                          [](const LogEntry& entry) -> Status {
                            const LogRecord expected = record_at(entry.record.sequence);
                            EXPECT_EQ(entry.record.operation, expected.operation);
                            EXPECT_EQ(entry.record.answer, expected.answer);
                            return {};
                          })
                    .ok());
    EXPECT_TRUE(check_log(*log).bad_snapshots.empty());
    acknowledged = log->last_sequence();
  }
  std::cout << "D1: " << loop << " kills (seed " << seed << "), " << more
            << " operations were durable beyond those acknowledged, 0 lost\n";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace handloft::store
