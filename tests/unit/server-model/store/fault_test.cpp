// The log on a disk that fails (reliability.md D2 - D5). A session of 300 real operations, some snapshots and
// checkpoints of the write-ahead log runs on a disk in memory; then every state that a crash could have left
// is made, opened, and compared with what had been durable. HANDLOFT_LONG=1: more operations, seeds and
// flips.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/store/group_commit.h"
#include "server-model/store/log_check.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "server-model/store/snapshot.h"
#include "tests/support/build_kind.h"
#include "tests/support/fault_disk.h"
#include "tests/support/stored_session.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
using Access = OperationLog::Access;
using test::Crash;
using test::FaultDisk;
using Failure = FaultDisk::Failure;

const bool long_run = std::getenv("HANDLOFT_LONG") != nullptr;
constexpr const char* file = "model.handloft";
/// So small that the session copies it into the file several times.
constexpr int checkpoint_pages = 40;

const test::StoredSession& session() {
  static const test::StoredSession one = test::stored_session(300, 11);
  return one;
}

const PreparedSnapshot& middle() {
  static const PreparedSnapshot one = *prepare_snapshot(session().middle);
  return one;
}

LogOptions on(const FaultDisk& disk) {
  LogOptions options;
  options.vfs = disk.name();
  options.mark = LogOptions::Mark::none;
  options.checkpoint_pages = checkpoint_pages;
  return options;
}

/// What had been durable when so many events had happened.
using Acknowledged = std::map<std::size_t, std::uint64_t>;

/// The session in commits of 1 to 12 records, until something fails. The last sequence that was acknowledged.
std::uint64_t run_session(FaultDisk& disk, Acknowledged* acknowledged = nullptr, Status* failure = nullptr) {
  std::mt19937_64 random(3);
  const auto note = [&](std::uint64_t sequence) {
    if (acknowledged != nullptr) (*acknowledged)[disk.events().size()] = sequence;
  };
  auto log = OperationLog::create(file, LogIdentity{{1, 2, 3}, 5}, on(disk));
  if (!log) {
    if (failure != nullptr) *failure = log.error();
    return 0;
  }
  const std::span<const LogRecord> records(session().records);
  std::uint64_t sequence = 0;
  bool snapshot_written = false;
  while (sequence < records.size()) {
    const std::size_t count = std::min<std::size_t>(1 + random() % 12, records.size() - sequence);
    if (auto status = log->append(records.subspan(sequence, count)); !status) {
      if (failure != nullptr) *failure = status;
      // Refused from now on, in the same words; what there is can be read.
      EXPECT_EQ(log->append(records.subspan(sequence, 1)).error().message, status.error().message);
      EXPECT_FALSE(log->failure().ok());
      return sequence;
    }
    sequence += count;
    note(sequence);
    if (sequence > 200 && !snapshot_written) {
      snapshot_written = true;
      if (auto status = write_snapshot(*log, middle(), 5); !status) {
        if (failure != nullptr) *failure = status;
        return sequence;
      }
    }
    log->tidy();
  }
  return sequence;
}

/// Empty: the log opens, and holds a prefix of the session with all that was acknowledged.
std::string complaint(const FaultDisk::Files& files, std::uint64_t acknowledged, bool also_as_model) {
  FaultDisk disk(files);
  auto log = OperationLog::open(file, Access::write, on(disk));
  if (!log) {
    // Before the making was finished nothing had been acknowledged.
    const bool unborn =
        log.error().code == ErrorCode::failed_precondition || log.error().code == ErrorCode::not_found;
    return unborn && acknowledged == 0 ? "" : log.error().describe();
  }
  const std::uint64_t last = log->last_sequence();
  if (last < acknowledged) return "lost " + std::to_string(acknowledged - last);
  std::string wrong;
  (void)log->read(1, [&](const LogEntry& entry) -> Status {
    const LogRecord& expected = session().records[entry.record.sequence - 1];
    if (entry.record.operation != expected.operation || entry.record.answer != expected.answer)
      wrong = "another operation at " + std::to_string(entry.record.sequence);
    return {};
  });
  if (!wrong.empty()) return wrong;
  if (const LogCheck check = check_log(*log); !check.bad_snapshots.empty())
    return check.bad_snapshots[0].words();
  if (also_as_model) {
    const auto recovered = recover(*log);
    if (!recovered) return recovered.error().describe();
    if (model::document_hash(recovered->model.document()) != session().hashes[last])
      return "another document";
  }
  // It goes on.
  if (last < session().records.size()) {
    if (auto status = log->append({&session().records[last], 1}); !status) return status.error().describe();
  }
  return "";
}

std::uint64_t acknowledged_by(const Acknowledged& acknowledged, std::size_t events) {
  const auto after = acknowledged.upper_bound(events);
  return after == acknowledged.begin() ? 0 : std::prev(after)->second;
}

TEST(StoreFaults, TheSessionItselfIsSound) {
  FaultDisk disk;
  EXPECT_EQ(run_session(disk), 300U);
  EXPECT_EQ(complaint(disk.files(), 300, true), "");
  // The oracle can tell: with an operation more than there are it complains.
  EXPECT_EQ(complaint(disk.files(), 301, false), "lost 1");
}

TEST(StoreFaults, D1D2EveryPrefixOfTheWritesRecoversWhatWasAcknowledged) {
  FaultDisk disk;
  Acknowledged acknowledged;
  ASSERT_EQ(run_session(disk, &acknowledged), 300U);
  const std::vector<FaultDisk::Event> events = disk.events();
  std::size_t states = 0;
  const std::uint64_t seeds = long_run ? 80 : 1;  // With two crashes of other kinds: 50,000 and more.
  // A sanitized build looks at every third index.
  const std::size_t stride = test::sanitized ? 3 : 1;
  for (std::size_t end = 0; end <= events.size(); end += stride) {
    const std::uint64_t durable = acknowledged_by(acknowledged, end);
    for (const Crash crash : {Crash::process_dies, Crash::power_fails, Crash::reorders}) {
      for (std::uint64_t seed = 0; seed < (crash == Crash::reorders ? seeds : 1); ++seed) {
        const auto files = test::after_crash({}, events, end, crash, end * 1000 + seed);
        ++states;
        ASSERT_EQ(complaint(files, durable, end % 16 == 0), "")
            << "at event " << end << " of " << events.size() << ", crash " << static_cast<int>(crash);
      }
    }
  }
  std::cout << "D1, D2: 300 operations, " << events.size() << " writes and flushes, " << states
            << " crashes: 0 lost, 0 that do not open\n";
}

TEST(StoreFaults, ALogThatDoesNotFlushIsFoundOut) {
  FaultDisk disk;
  Acknowledged acknowledged;
  {
    auto log = OperationLog::create(file, LogIdentity{{1, 2, 3}, 5}, on(disk));
    ASSERT_TRUE(log.ok() && log->database().execute("PRAGMA synchronous=OFF").ok());
    for (std::size_t i = 0; i < 20; ++i) {
      ASSERT_TRUE(log->append({&session().records[i], 1}).ok());
      acknowledged[disk.events().size()] = i + 1;
    }
  }
  std::size_t lost = 0;
  for (std::size_t end = 0; end <= disk.events().size(); ++end) {
    const auto files = test::after_crash({}, disk.events(), end, Crash::power_fails, 0);
    lost += complaint(files, acknowledged_by(acknowledged, end), false).empty() ? 0 : 1;
  }
  EXPECT_GT(lost, 10U);
}

TEST(StoreFaults, D2EveryFailingOrTornWriteLeavesWhatWasAcknowledged) {
  FaultDisk whole;
  ASSERT_EQ(run_session(whole), 300U);
  const std::size_t writes = whole.events().size();
  std::size_t faults = 0, refused = 0;
  const std::size_t stride = test::sanitized ? 3 : 1;
  for (std::size_t index = 0; index < writes; index += stride) {
    for (const Failure failure : {Failure::error, Failure::torn_error}) {
      FaultDisk disk;
      disk.fail_at(index, failure);
      Status status;
      const std::uint64_t acknowledged = run_session(disk, nullptr, &status);
      ++faults;
      if (!status) ++refused;
      ASSERT_EQ(complaint(disk.files(), acknowledged, index % 16 == 0), "") << "write " << index;
    }
  }
  // Some fail where nothing depends on them (a checkpoint at the end); most are told.
  EXPECT_GT(refused, faults / 2);
  std::cout << "D2: " << faults << " failing or torn writes, " << refused
            << " told to the writer, 0 acknowledged operations lost\n";
}

TEST(StoreFaults, D3ASecondCrashDuringRecoveryStillRecovers) {
  FaultDisk first;
  Acknowledged acknowledged;
  ASSERT_EQ(run_session(first, &acknowledged), 300U);
  const std::vector<FaultDisk::Event> events = first.events();
  std::mt19937_64 random(5);
  std::size_t crashes = 0, read_errors = 0;
  const std::size_t wanted = test::sanitized ? 70 : 200;
  // The long run has a first crash at every index, and a second at every one of the recovery's.
  for (std::size_t first_crash = 0; long_run ? first_crash <= events.size() : crashes < wanted;
       ++first_crash) {
    const std::size_t end = long_run ? first_crash : random() % (events.size() + 1);
    const std::uint64_t durable = acknowledged_by(acknowledged, end);
    const auto files = test::after_crash({}, events, end, Crash::reorders, random());
    // Recovering: open, go on with one operation, close (which copies the write-ahead log into the file).
    FaultDisk second(files);
    ASSERT_EQ(
        [&] {
          auto log = OperationLog::open(file, Access::write, on(second));
          if (log && log->last_sequence() < 300)
            (void)log->append({&session().records[log->last_sequence()], 1});
          return 0;
        }(),
        0);
    for (std::size_t at = 0; at <= second.events().size() && (long_run || crashes < wanted); ++at) {
      for (const Crash crash : {Crash::process_dies, Crash::power_fails, Crash::reorders}) {
        ++crashes;
        ASSERT_EQ(complaint(test::after_crash(files, second.events(), at, crash, random()), durable, at == 0),
                  "")
            << "first crash at " << end << ", second at " << at;
      }
    }
    // A read that fails once: refused, nothing is lost.
    if (second.reads() > 0) {
      FaultDisk third(files);
      third.fail_at(random() % second.reads(), Failure::read_error);
      { (void)OperationLog::open(file, Access::write, on(third)); }
      ++read_errors;
      ASSERT_EQ(complaint(third.files(), durable, false), "");
    }
  }
  std::cout << "D3: " << crashes << " crashes and " << read_errors
            << " failing reads during recovery: 0 lost\n";
}

TEST(StoreFaults, D5AFullDiskOrDeadDeviceMakesItReadOnlyInWords) {
  FaultDisk whole;
  ASSERT_EQ(run_session(whole), 300U);
  const std::size_t writes = whole.events().size();
  const std::size_t points = long_run ? writes : 50;
  std::size_t full = 0;
  for (std::size_t i = 0; i < points; ++i) {
    for (const Failure failure : {Failure::full_for_good, Failure::error_for_good}) {
      FaultDisk disk;
      disk.fail_at(i * writes / points, failure);
      Status status;
      const std::uint64_t acknowledged = run_session(disk, nullptr, &status);
      if (!status && failure == Failure::full_for_good) {
        ++full;
        EXPECT_EQ(status.error().code, ErrorCode::resource_exhausted) << status.error().describe();
        EXPECT_NE(status.error().message.find("the disk is full"), std::string::npos);
      } else if (!status) {
        EXPECT_EQ(status.error().code, ErrorCode::io) << status.error().describe();
      }
      ASSERT_EQ(complaint(disk.files(), acknowledged, i % 8 == 0), "") << i;
    }
  }
  EXPECT_GT(full, points / 2);
  std::cout << "D5: " << 2 * points << " points, " << full
            << " full disks named, 0 acknowledged operations lost\n";
}

TEST(StoreFaults, D5AReadThatFailsAnywhereIsRefusedInWordsAndLosesNothing) {
  FaultDisk whole;
  ASSERT_EQ(run_session(whole), 300U);
  const auto files = whole.files();
  const auto look = [&](FaultDisk& disk) -> Status {
    auto log = OperationLog::open(file, Access::write, on(disk));
    if (!log) return log.error();
    auto recovered = recover(*log);
    if (!recovered) return recovered.error();
    EXPECT_EQ(model::document_hash(recovered->model.document()), session().hashes[300]);
    return {};
  };
  FaultDisk sound(files);
  ASSERT_TRUE(look(sound).ok());
  const std::size_t reads = sound.reads();
  const std::size_t stride = long_run ? 1 : std::max<std::size_t>(1, reads / 50);
  std::size_t refused = 0, tried = 0;
  for (std::size_t at = 0; at < reads; at += stride) {
    FaultDisk disk(files);
    disk.fail_at(at, Failure::read_error);
    ++tried;
    if (const Status status = look(disk); !status) {
      ++refused;
      EXPECT_FALSE(status.error().message.empty());
    }
    ASSERT_EQ(complaint(disk.files(), 300, false), "") << "read " << at;
  }
  EXPECT_GT(refused, tried / 2);
  std::cout << "D5: " << tried << " of " << reads << " reads failed, " << refused
            << " told, 0 acknowledged operations lost\n";
}

TEST(StoreFaults, D5AnyOtherCallThatFailsIsToldAndLosesNothing) {
  FaultDisk whole;
  ASSERT_EQ(run_session(whole), 300U);
  const std::size_t calls = whole.calls();
  const std::size_t stride = long_run ? 1 : std::max<std::size_t>(1, calls / 50);
  std::size_t told = 0, tried = 0;
  for (std::size_t at = 0; at < calls; at += stride) {
    FaultDisk disk;
    disk.fail_at(at, Failure::call_error);
    Status status;
    const std::uint64_t acknowledged = run_session(disk, nullptr, &status);
    ++tried;
    if (!status) {
      ++told;
      EXPECT_FALSE(status.error().message.empty());
    } else {
      EXPECT_EQ(acknowledged, 300U);
    }
    ASSERT_EQ(complaint(disk.files(), acknowledged, at % 16 == 0), "") << "call " << at;
  }
  EXPECT_GT(told, tried / 2);
  std::cout << "D5: " << tried << " of " << calls << " other calls failed, " << told
            << " told, 0 acknowledged operations lost\n";
}

TEST(StoreFaults, D5TheWritingThreadTellsEveryoneThatWaits) {
  FaultDisk disk;
  auto log = OperationLog::create(file, LogIdentity{{1, 2, 3}, 5}, on(disk));
  ASSERT_TRUE(log.ok());
  ASSERT_TRUE(log->append(std::span(session().records).first(10)).ok());
  disk.fail_at(0, Failure::full_for_good);
  std::size_t told = 0;
  GroupCommit commit(*std::move(log));
  for (std::size_t i = 10; i < 30; ++i) {
    commit.append(session().records[i], [&](const Status& status) { told += status.ok() ? 0 : 1; });
  }
  commit.flush();
  EXPECT_EQ(told, 20U);
  EXPECT_FALSE(commit.accepting());
  EXPECT_NE(commit.failure().error().message.find("the disk is full"), std::string::npos);
  commit.stop();
  EXPECT_EQ(complaint(disk.files(), 10, true), "");
}

// --- D4 on real files, with the mark beside

class StoreRot : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "handloft-rot-XXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder = pattern;
  }
  void TearDown() override { fs::remove_all(folder); }

  static std::string read_all(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void write_all(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  /// How the session ended.
  enum class Left {
    closed,
    crashed,            ///< Half of it in the file, half in a write-ahead log that had begun anew.
    crashed_unchecked,  ///< All of it in the write-ahead log.
  };

  std::map<std::string, std::string> make(Left left) {
    const fs::path path = folder / "made";
    std::map<std::string, std::string> files;
    {
      auto log = OperationLog::create(path, LogIdentity{{1, 2, 3}, 5});
      EXPECT_TRUE(log.ok());
      const std::span<const LogRecord> records(session().records);
      EXPECT_TRUE(log->append(records.first(150)).ok());
      EXPECT_TRUE(write_snapshot(*log, middle(), 5).ok());
      if (left != Left::crashed_unchecked) {
        EXPECT_TRUE(log->database().checkpoint().ok());
      }
      for (std::size_t i = 150; i < 300; i += 10) EXPECT_TRUE(log->append(records.subspan(i, 10)).ok());
      if (left != Left::closed) {
        for (const char* suffix : {"", "-wal", "-mark"}) files[suffix] = read_all(path.string() + suffix);
      }
    }
    if (left == Left::closed) {
      for (const char* suffix : {"", "-mark"}) files[suffix] = read_all(path.string() + suffix);
    }
    return files;
  }

  /// Bytes that belong together, and whether recovery looks at any of them.
  struct Place {
    std::string suffix;
    std::size_t from = 0, size = 0;
    enum class Use { live, superseded };
    Use use = Use::live;
  };

  /// Each page of the file, and the header and each frame of the write-ahead log
  /// (sqlite.org/fileformat2.html, 4.1): of a log that has begun anew the frames behind the new ones, whose
  /// salts are others, are superseded, and so are pages of the file that a live frame has.
  static std::vector<Place> places(const std::map<std::string, std::string>& files) {
    constexpr std::size_t page = 4096, wal_header = 32, frame_header = 24, salts_at = 16, salts = 8;
    std::vector<Place> all;
    std::set<std::uint32_t> newer;
    if (const auto wal = files.find("-wal"); wal != files.end()) {
      const std::string& bytes = wal->second;
      all.push_back({"-wal", 0, wal_header});
      bool live = true;
      for (std::size_t at = wal_header; at + frame_header + page <= bytes.size(); at += frame_header + page) {
        live = live && bytes.compare(at + 8, salts, bytes, salts_at, salts) == 0;
        all.push_back({"-wal", at, frame_header + page, live ? Place::Use::live : Place::Use::superseded});
        std::uint32_t number = 0;
        for (std::size_t i = 0; i < 4; ++i) number = number << 8U | static_cast<unsigned char>(bytes[at + i]);
        if (live) newer.insert(number);
      }
    }
    for (std::size_t at = 0; at < files.at("").size(); at += page) {
      const auto number = static_cast<std::uint32_t>(at / page + 1);
      all.push_back({"", at, page, newer.contains(number) ? Place::Use::superseded : Place::Use::live});
    }
    all.push_back({"-mark", 0, files.at("-mark").size()});
    return all;
  }

  enum class Seen { detected, harmless, served };
  struct Look {
    Seen seen = Seen::served;
    std::string words;       ///< What was said of it.
    std::uint64_t good = 0;  ///< Operations that are good all the same.
  };
  /// Nothing that is served may differ from what was written, and what is detected is named, with the good
  /// prefix of the session still to be had.
  Look look(const std::map<std::string, std::string>& files) {
    const fs::path path = folder / "looked";
    for (const char* suffix : {"", "-wal", "-shm", "-mark"}) fs::remove(path.string() + suffix);
    for (const auto& [suffix, bytes] : files) write_all(path.string() + suffix, bytes);
    Look result;
    {
      auto log = OperationLog::open(path, Access::write);
      if (log) {
        if (const LogCheck check = check_log(*log); !check.bad_snapshots.empty())
          result = {Seen::detected, check.bad_snapshots[0].words(), log->last_sequence()};
        if (log->last_sequence() != 300) return {};
        if (result.seen == Seen::served && log->snapshots()->empty()) return {};
        for (const LogRecord& record : session().records) {
          if (record.client_op_id == 0) continue;
          const auto found = log->find(record.client_id, record.client_op_id);
          if (!found || !*found || (*found)->record.operation != record.operation) return {};
        }
        const auto recovered = recover(*log);
        if (!recovered || model::document_hash(recovered->model.document()) != session().hashes[300])
          return {};
        if (result.seen == Seen::served) result = {Seen::harmless, "", 300};
        return result;
      }
      result = {Seen::detected, log.error().describe(), 0};
    }
    auto log = OperationLog::open(path, Access::read);
    if (!log) return result;
    (void)log->read(1, [&](const LogEntry& entry) -> Status {
      const LogRecord& expected = session().records[entry.record.sequence - 1];
      if (entry.record.operation != expected.operation || entry.record.answer != expected.answer ||
          entry.record.client_id != expected.client_id)
        result.seen = Seen::served;
      result.good = entry.record.sequence;
      return {};
    });
    return result;
  }

  void flip(Left left, const char* words, std::size_t flips) {
    const auto good = make(left);
    ASSERT_EQ(look(good).seen, Seen::harmless);
    std::vector<Place> live, superseded;
    for (const Place& place : places(good))
      (place.use == Place::Use::live ? live : superseded).push_back(place);
    std::mt19937_64 random(static_cast<std::uint64_t>(left) + 1);
    // Round all places that are read, so that each is hit as often; one in twenty where nobody looks.
    constexpr std::size_t one_in = 20;
    std::size_t detected = 0, harmless = 0, lost_some = 0, next = 0, next_superseded = 0;
    for (std::size_t i = 0; i < flips; ++i) {
      const bool unread = i % one_in == 0 && !superseded.empty();
      const Place& place =
          unread ? superseded[next_superseded++ % superseded.size()] : live[next++ % live.size()];
      auto files = good;
      const std::size_t at = place.from + random() % place.size;
      char& byte = files.at(place.suffix)[at];
      byte = static_cast<char>(byte ^ static_cast<char>(1U << (random() % 8)));
      const Look seen = look(files);
      ASSERT_NE(seen.seen, Seen::served) << "byte " << at << " of FILE" << place.suffix << " " << seen.words;
      if (unread) {
        EXPECT_EQ(seen.seen, Seen::harmless) << "byte " << at << " of FILE" << place.suffix;
      }
      if (seen.seen == Seen::detected) {
        EXPECT_GT(seen.words.size(), 10U);
        lost_some += seen.good < 300 ? 1 : 0;
      }
      // Each frame has its checksum, and the mark knows how many there were.
      if (!unread && place.suffix == "-wal") {
        EXPECT_EQ(seen.seen, Seen::detected) << "byte " << at << " of FILE-wal";
        EXPECT_TRUE(seen.words.find("was saved") != std::string::npos ||
                    seen.words.find("never finished") != std::string::npos)
            << seen.words;
      }
      ++(seen.seen == Seen::detected ? detected : harmless);
    }
    std::cout << "D4: " << flips << " flipped bits in " << live.size()
              << " pages and frames that are read and " << superseded.size() << " that are not, " << words
              << ": " << detected << " detected (" << lost_some
              << " with operations behind them that are not good), " << harmless << " harmless, 0 served\n";
    EXPECT_GT(detected, flips / 2);
    // Each place has been hit.
    EXPECT_GE(next, std::min(flips, live.size()));
  }

  fs::path folder;
};

const std::size_t rot_flips = long_run ? 10'000 : test::sanitized ? 100 : 250;

TEST_F(StoreRot, D4OneBitOfAClosedLogIsDetectedOrHarmless) {
  flip(Left::closed, "of a closed log", rot_flips);
}

TEST_F(StoreRot, D4OneBitOfACrashedLogIsDetectedOrHarmless) {
  flip(Left::crashed, "as a crash leaves them", rot_flips);
}

TEST_F(StoreRot, D4OneBitOfALogThatIsAllAheadIsDetectedOrHarmless) {
  flip(Left::crashed_unchecked, "as a crash before any checkpoint leaves them", rot_flips);
}

}  // namespace
}  // namespace handloft::store
