// Files of every format that was ever released open, forever, as the models that they were (D8). A folder
// tests/data/models_vN has files written by a program of that time, and what came of them. Such files are
// never made anew: a new format gets a folder of its own.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/store/log_check.h"
#include "server-model/store/model_store.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "tests/support/test_data.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
using Access = OperationLog::Access;

struct Released {
  fs::path file;
  std::uint64_t operations = 0;
  std::string hash;
};

std::string read_all(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<Released> corpus() {
  std::vector<Released> found;
  for (const auto& folder : fs::directory_iterator("tests/data")) {
    if (!folder.path().filename().string().starts_with("models_v")) continue;
    const auto expected = nlohmann::json::parse(read_all(folder.path() / "expected.json"));
    for (const auto& [name, facts] : expected.items()) {
      found.push_back({folder.path() / name, facts.at("operations").get<std::uint64_t>(),
                       facts.at("hash").get<std::string>()});
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.file < b.file; });
  return found;
}

/// A copy with all that belongs to it, since whoever opens a file may write beside it.
fs::path copy_of(const Released& released, const fs::path& folder) {
  const fs::path path = folder / released.file.filename();
  for (const char* suffix : {"", "-wal", "-mark"}) {
    const fs::path from = released.file.string() + suffix;
    if (fs::exists(from)) fs::copy_file(from, path.string() + suffix, fs::copy_options::overwrite_existing);
  }
  return path;
}

TEST(ReleasedFormats, D8EachFileOfTheCorpusIsListedAndEachFormatIsThere) {
  std::size_t files = 0;
  for (const auto& folder : fs::directory_iterator("tests/data")) {
    if (!folder.path().filename().string().starts_with("models_v")) continue;
    for (const auto& entry : fs::directory_iterator(folder.path()))
      files += entry.path().extension() == ".handloft" ? 1 : 0;
  }
  EXPECT_EQ(corpus().size(), files);
  EXPECT_GE(files, 13U);
}

TEST(ReleasedFormats, D8EveryReleasedFileOpensAsTheModelThatItWas) {
  for (const Released& released : corpus()) {
    SCOPED_TRACE(released.file);
    const test::TemporaryDirectory folder;
    const fs::path path = copy_of(released, folder.path());
    const std::string before = read_all(path);
    auto log = OperationLog::open(path, Access::read);
    ASSERT_TRUE(log.ok()) << log.error().describe();
    const LogCheck check = check_log(*log);
    EXPECT_TRUE(check.good()) << check.damages[0].words();
    EXPECT_TRUE(check.bad_snapshots.empty()) << check.bad_snapshots[0].words();
    EXPECT_EQ(log->last_sequence(), released.operations);
    for (const auto snapshots : {RecoveryOptions::Snapshots::used, RecoveryOptions::Snapshots::ignored}) {
      RecoveryOptions options;
      options.snapshots = snapshots;
      const auto recovered = recover(*log, {}, options);
      ASSERT_TRUE(recovered.ok()) << recovered.error().describe();
      EXPECT_EQ(model::document_hash(recovered->model.document()), released.hash);
      EXPECT_EQ(recovered->model.sequence(), released.operations);
    }
    // Looking has changed nothing.
    EXPECT_EQ(read_all(path), before);
  }
}

TEST(ReleasedFormats, D8WorkGoesOnWithEveryReleasedFile) {
  for (const Released& released : corpus()) {
    SCOPED_TRACE(released.file);
    const test::TemporaryDirectory folder;
    const fs::path path = copy_of(released, folder.path());
    std::string hash;
    {
      auto opened = ModelStore::open(path, {});
      ASSERT_TRUE(opened.ok()) << opened.error().describe();
      EXPECT_EQ(model::document_hash(opened->model.document()), released.hash);
      v1::Operation operation;
      operation.mutable_create_dual_shape()->set_id("of-now");
      const auto done = opened->model.submit(operation);
      ASSERT_TRUE(done.ok()) << done.error().describe();
      EXPECT_EQ(done->sequence, released.operations + 1);
      hash = model::document_hash(opened->model.document());
      EXPECT_NE(hash, released.hash);
      opened->store->stop();
    }
    auto again = ModelStore::open(path, {});
    ASSERT_TRUE(again.ok()) << again.error().describe();
    EXPECT_EQ(model::document_hash(again->model.document()), hash);
    again->store->stop();
  }
}

TEST(ReleasedFormats, D8OneOfThemWasLeftByACrashAndOneHasASnapshot) {
  bool crashed = false, snapshot = false;
  for (const Released& released : corpus()) {
    crashed = crashed || fs::exists(released.file.string() + "-wal");
    const test::TemporaryDirectory folder;
    auto log = OperationLog::open(copy_of(released, folder.path()), Access::read);
    ASSERT_TRUE(log.ok()) << log.error().describe();
    snapshot = snapshot || !log->snapshots()->empty();
  }
  EXPECT_TRUE(crashed);
  EXPECT_TRUE(snapshot);
}

TEST(ReleasedFormats, D4AnOldFileThatHasRottedIsNamed) {
  const auto files = corpus();
  const auto saddle =
      std::find_if(files.begin(), files.end(), [](const auto& one) { return one.file.stem() == "saddle"; });
  ASSERT_NE(saddle, files.end());
  const test::TemporaryDirectory folder;
  const fs::path path = copy_of(*saddle, folder.path());
  std::string bytes = read_all(path);
  const std::size_t at = bytes.find("Cloud");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'c';
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  auto log = OperationLog::open(path, Access::write);
  ASSERT_FALSE(log.ok());
  EXPECT_EQ(log.error().code, ErrorCode::data_corrupt) << log.error().describe();
}

}  // namespace
}  // namespace handloft::store
