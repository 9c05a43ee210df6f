// What a list of models tells of a file without restoring its model: the same as the restored model (U6).

#include "server-model/store/summary.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server-model/store/recovery.h"
#include "server-model/store/snapshot.h"
#include "tests/support/test_data.h"

namespace handloft::store {
namespace {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;

class Listed : public testing::Test {
 protected:
  Listed() : log_(*OperationLog::create(fs::path(folder_.path()) / "seat.handloft", new_identity(5))) {}

  void must(const v1::Operation& operation) {
    const auto submitted = model_.submit(operation);
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
    const LogRecord record =
        make_record(*submitted, 1, 1000 + static_cast<std::int64_t>(submitted->sequence));
    ASSERT_TRUE(log_.append({&record, 1}).ok());
  }
  void create(const std::string& id) {
    v1::Operation operation;
    operation.mutable_create_dual_shape()->set_id(id);
    must(operation);
  }
  void name(const std::string& name) {
    v1::Operation operation;
    operation.set_author("Ann");
    operation.set_made_ns(77);
    operation.mutable_name_version()->set_name(name);
    operation.mutable_name_version()->set_note("for the review");
    must(operation);
  }
  void undo() {
    v1::Operation operation;
    operation.mutable_undo();
    must(operation);
  }
  void snapshot() {
    auto prepared = prepare_snapshot({model_.history(), model_.sequence()});
    ASSERT_TRUE(prepared.ok());
    ASSERT_TRUE(write_snapshot(log_, *std::move(prepared), 1).ok());
  }
  Summary summary() const {
    auto summary = summarize(log_);
    EXPECT_TRUE(summary.ok()) << (summary ? "" : summary.error().describe());
    return summary ? *std::move(summary) : Summary();
  }
  static std::vector<std::string> names(const Summary& summary) {
    std::vector<std::string> all;
    for (const NamedVersion& version : summary.versions) all.push_back(version.name);
    return all;
  }

  using Names = std::vector<std::string>;
  test::TemporaryDirectory folder_;
  OperationLog log_;
  model::Model model_;
};

TEST_F(Listed, AnEmptyOne) {
  const Summary empty = summary();
  EXPECT_EQ(empty.operations, 0U);
  EXPECT_EQ(empty.created_ns, 5);
  EXPECT_EQ(empty.changed_ns, 5);
  EXPECT_FALSE(empty.restored);
  ASSERT_EQ(empty.alternatives.size(), 1U);
  EXPECT_EQ(empty.alternatives[0].name, "main");
}

TEST_F(Listed, U6_WithoutASnapshotAndWithoutVersionsNothingIsRestored) {
  create("seat");
  create("back");
  const Summary found = summary();
  EXPECT_EQ(found.operations, 2U);
  EXPECT_EQ(found.changed_ns, 1002);
  EXPECT_EQ(names(found), Names());
  EXPECT_FALSE(found.restored);
}

TEST_F(Listed, U6_VersionsOfTheSnapshotAndThoseBehindIt) {
  create("seat");
  name("final");
  name("draft");
  EXPECT_TRUE(summary().restored);
  EXPECT_EQ(names(summary()), (Names{"final", "draft"})) << "as they were named";
  snapshot();
  create("back");
  const Summary found = summary();
  EXPECT_FALSE(found.restored);
  EXPECT_EQ(found.snapshot_sequence, 3U);
  ASSERT_EQ(names(found), (Names{"final", "draft"}));
  EXPECT_EQ(found.versions[0].author, "Ann");
  EXPECT_EQ(found.versions[0].note, "for the review");
  EXPECT_EQ(found.versions[0].made_ns, 77);
  EXPECT_EQ(found.versions[0].alternative, "main");
  EXPECT_EQ(found.versions[0].sequence, 2U);
  EXPECT_EQ(found.alternatives[0].version, "draft");
  // What is taken back behind the snapshot is not told.
  undo();
  EXPECT_FALSE(summary().restored);
  undo();
  EXPECT_TRUE(summary().restored);
  EXPECT_EQ(names(summary()), (Names{"final"}));
  EXPECT_EQ(summary().alternatives[0].version, "final");
}

TEST_F(Listed, U6_AlternativesToo) {
  create("seat");
  snapshot();
  v1::Operation wide;
  wide.mutable_new_alternative()->set_name("wide");
  must(wide);
  const Summary found = summary();
  EXPECT_TRUE(found.restored);
  ASSERT_EQ(found.alternatives.size(), 2U);
  snapshot();
  EXPECT_FALSE(summary().restored);
  EXPECT_EQ(summary().alternatives.size(), 2U);
}

TEST_F(Listed, D4_ASnapshotThatHasRottedIsNotBelieved) {
  create("seat");
  name("draft");
  snapshot();
  ASSERT_TRUE(log_.database().execute("UPDATE snapshots SET manifest = x'00'").ok());
  EXPECT_TRUE(summary().restored);
  EXPECT_EQ(names(summary()), (Names{"draft"}));
}

}  // namespace
}  // namespace handloft::store
