// Backups while a model is worked on (issue 7, part 6): whole, checked, restorable, and never over a file
// that is there.

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "server-model/model/canonical.h"
#include "server-model/store/backup.h"
#include "server-model/store/log_check.h"
#include "server-model/store/model_store.h"
#include "tests/support/stored_session.h"
#include "tests/support/test_data.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
using Access = OperationLog::Access;

const test::StoredSession& session() {
  static const test::StoredSession one = test::stored_session(300, 5);
  return one;
}

std::string hash_of(const fs::path& path) {
  auto opened = ModelStore::open(path, {});
  EXPECT_TRUE(opened.ok()) << opened.error().describe();
  if (!opened) return "";
  opened->store->stop();
  return model::document_hash(opened->model.document());
}

TEST(Backup, OneThatIsTakenWhileItIsWrittenIsAPrefixThatCanBeRestored) {
  const test::TemporaryDirectory folder;
  const fs::path path = folder.path() / "seat.handloft";
  auto log = OperationLog::create(path, LogIdentity{{4}, 5});
  ASSERT_TRUE(log.ok());
  ASSERT_TRUE(log->append(std::span(session().records).first(1)).ok());
  std::atomic<bool> failed = false;
  std::thread writer([&] {
    for (std::size_t i = 1; i < session().records.size(); ++i) {
      if (!log->append({&session().records[i], 1})) failed = true;
      log->tidy();
    }
  });
  std::vector<fs::path> backups;
  for (int i = 0; i < 12; ++i) {
    const fs::path to = folder.path() / ("backup" + std::to_string(i) + ".handloft");
    const auto backup = back_up(path, to);
    ASSERT_TRUE(backup.ok()) << backup.error().describe();
    EXPECT_EQ(backup->bytes, fs::file_size(to));
    auto copy = OperationLog::open(to, Access::read);
    ASSERT_TRUE(copy.ok());
    EXPECT_EQ(copy->last_sequence(), backup->operations);
    backups.push_back(to);
  }
  writer.join();
  EXPECT_FALSE(failed);
  for (const fs::path& backup : backups) {
    auto copy = OperationLog::open(backup, Access::read);
    const std::uint64_t operations = copy->last_sequence();
    EXPECT_TRUE(check_log(*copy).good());
    // Restored: opened for writing, it is the model as it was, and work goes on.
    EXPECT_EQ(hash_of(backup), session().hashes[operations]);
    if (operations < session().records.size()) {
      auto again = OperationLog::open(backup, Access::write);
      ASSERT_TRUE(again.ok()) << again.error().describe();
      EXPECT_TRUE(again->append({&session().records[operations], 1}).ok());
    }
  }
  const auto last = back_up(path, folder.path() / "last.handloft");
  ASSERT_TRUE(last.ok());
  EXPECT_EQ(last->operations, 300U);
  EXPECT_EQ(hash_of(folder.path() / "last.handloft"), session().hashes[300]);
  for (const auto& entry : fs::directory_iterator(folder.path()))
    EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
}

TEST(Backup, NeverReplacesAFile) {
  const test::TemporaryDirectory folder;
  const fs::path path = folder.path() / "a.handloft", to = folder.path() / "precious";
  { ASSERT_TRUE(OperationLog::create(path, LogIdentity{{4}, 5}).ok()); }
  std::ofstream(to) << "mine";
  const auto refused = back_up(path, to);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::already_exists);
  std::ifstream in(to);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "mine");
}

TEST(Backup, OfADamagedFileOrOfNoneIsRefusedAndLeavesNothing) {
  const test::TemporaryDirectory folder;
  const fs::path path = folder.path() / "a.handloft", to = folder.path() / "b.handloft";
  EXPECT_EQ(back_up(path, to).error().code, ErrorCode::not_found);
  {
    auto log = OperationLog::create(path, LogIdentity{{4}, 5});
    ASSERT_TRUE(log.ok() && log->append(session().records).ok() && log->database().checkpoint().ok());
  }
  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  const std::size_t at = bytes.find(session().records[150].operation);
  ASSERT_NE(at, std::string::npos);
  bytes[at + 3] = static_cast<char>(bytes[at + 3] ^ 1);
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  const auto refused = back_up(path, to);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::data_corrupt);
  EXPECT_NE(refused.error().message.find("operation"), std::string::npos) << refused.error().describe();
  EXPECT_FALSE(fs::exists(to));
  EXPECT_FALSE(fs::exists(to.string() + ".part"));
}

}  // namespace
}  // namespace handloft::store
