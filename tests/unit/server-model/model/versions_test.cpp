// U6: named versions of a design, restored, branched from, and what was done between two of them in words.

#include <string>
#include <vector>

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

constexpr std::uint64_t ann = 11;
constexpr std::uint64_t bob = 12;

v1::Operation by(std::uint64_t client, v1::Operation operation) {
  operation.set_client_id(client);
  operation.set_author(client == ann ? "Ann" : client == bob ? "Bob" : "");
  operation.set_made_ns(5);
  return operation;
}

v1::Operation name_version(const std::string& name, const std::string& note = {}) {
  v1::Operation operation;
  operation.mutable_name_version()->set_name(name);
  operation.mutable_name_version()->set_note(note);
  return operation;
}

v1::Operation restore(const std::string& name) {
  v1::Operation operation;
  operation.mutable_restore_version()->set_name(name);
  return operation;
}

v1::Operation delete_version(const std::string& name) {
  v1::Operation operation;
  operation.mutable_delete_version()->set_name(name);
  return operation;
}

v1::Operation branch(const std::string& name, const std::string& version) {
  v1::Operation operation;
  operation.mutable_new_alternative()->set_name(name);
  operation.mutable_new_alternative()->set_version(version);
  return operation;
}

v1::Operation move(const std::string& id, double x) {
  v1::Operation operation;
  operation.mutable_transform()->add_entities(id);
  operation.mutable_transform()->mutable_translation()->set_x(x);
  return operation;
}

class Versions : public ::testing::Test {
 protected:
  Submitted must(const v1::Operation& operation) {
    auto submitted = model_.submit(operation);
    EXPECT_TRUE(submitted.ok()) << operation.ShortDebugString() << ": "
                                << (submitted.ok() ? "" : submitted.error().describe());
    return submitted ? *submitted : Submitted{};
  }
  std::string refused(const v1::Operation& operation) {
    const std::string hash = document_hash(model_.document());
    const auto submitted = model_.submit(operation);
    EXPECT_EQ(document_hash(model_.document()), hash);
    return submitted ? std::string("accepted")
                     : std::string(to_string(submitted.error().code)) + " " + submitted.error().field;
  }
  v1::VersionsResult list() const {
    v1::Query query;
    query.mutable_versions();
    return model_.query(query)->versions();
  }
  v1::DifferenceResult difference(const std::string& from, const std::string& to = {}) const {
    v1::Query query;
    query.mutable_difference()->set_from(from);
    query.mutable_difference()->set_to(to);
    const auto result = model_.query(query);
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().describe());
    return result ? result->difference() : v1::DifferenceResult();
  }
  std::vector<std::string> sentences(const std::string& from, const std::string& to = {}) const {
    const v1::DifferenceResult result = difference(from, to);
    return {result.sentences().begin(), result.sentences().end()};
  }
  std::string hash() const { return document_hash(model_.document()); }

  Model model_;
};

TEST_F(Versions, U6_RestoreGivesBackWhatWasNamedAndIsUndone) {
  must(create("seat"));
  must(add("seat", saddle_points()));
  const Document::Entities kept = model_.document().entities;
  EXPECT_EQ(must(by(ann, name_version("draft", "before the meeting"))).words,
            "Name version \"draft\" of \"main\"");
  must(fit("seat"));
  must(create("back"));
  const std::string before = hash();
  EXPECT_EQ(must(restore("draft")).words, "Restore version \"draft\" into \"main\"");
  EXPECT_EQ(model_.document().entities, kept) << "shared, not copied";
  EXPECT_EQ(refused(create("back")), "already_exists create_dual_shape.id") << "its id stays used";
  must(undo());
  EXPECT_EQ(hash(), before);
  ASSERT_EQ(list().versions_size(), 1);
  const v1::Version version = list().versions(0);
  EXPECT_EQ(version.name(), "draft");
  EXPECT_EQ(version.note(), "before the meeting");
  EXPECT_EQ(version.author(), "Ann");
  EXPECT_EQ(version.made_ns(), 5);
  EXPECT_EQ(version.alternative(), "main");
  EXPECT_EQ(version.sequence(), 3U);
  EXPECT_EQ(version.parent(), "");
  must(restore("draft"));
  EXPECT_EQ(must(restore("draft")).sequence, 0U) << "it is as it was: nothing to be undone";
}

TEST_F(Versions, U6_AVersionKnowsTheOneItCameFrom) {
  must(create("seat"));
  must(name_version("1"));
  must(move("seat", 0.1));
  must(name_version("2"));
  must(restore("1"));
  must(create("arm"));
  must(name_version("1b"));
  must(branch("wide", "2"));
  EXPECT_EQ(model_.document().present_alternative(), "wide");
  EXPECT_FALSE(model_.document().find("arm"));
  must(create("shelf"));
  must(name_version("2b"));
  const v1::VersionsResult all = list();
  ASSERT_EQ(all.versions_size(), 4);
  EXPECT_EQ(all.versions(1).parent(), "1");
  EXPECT_EQ(all.versions(2).name(), "1b");
  EXPECT_EQ(all.versions(2).parent(), "1");
  EXPECT_EQ(all.versions(3).parent(), "2");
  EXPECT_EQ(all.versions(3).alternative(), "wide");
  // What came after a version that is forgotten comes after the one before it.
  must(delete_version("2"));
  EXPECT_EQ(list().versions(2).parent(), "1");
  must(undo());
  EXPECT_EQ(list().versions(3).parent(), "2");
}

TEST_F(Versions, U6_OfEachTheUndoIsBitIdentical) {
  must(create("seat"));
  must(add("seat", saddle_points()));
  std::vector<std::string> hashes{hash()};
  for (const v1::Operation& operation :
       {name_version("1"), move("seat", 0.1), name_version("2"), restore("1"), branch("wide", "2"),
        name_version("3"), delete_version("2"), delete_version("1")}) {
    must(operation);
    hashes.push_back(hash());
    EXPECT_NE(hashes.back(), hashes[hashes.size() - 2]) << operation.ShortDebugString();
  }
  for (std::size_t i = hashes.size() - 1; i > 0; --i) {
    must(undo());
    EXPECT_EQ(hash(), hashes[i - 1]) << i;
  }
  for (std::size_t i = 1; i < hashes.size(); ++i) {
    must(redo());
    EXPECT_EQ(hash(), hashes[i]) << i;
  }
}

TEST_F(Versions, U1U6_AVersionThatSomebodyBuildsOnIsNotTakenBack) {
  must(by(ann, name_version("1")));
  must(by(bob, branch("wide", "1")));
  const auto submitted = model_.submit(by(ann, undo()));
  ASSERT_FALSE(submitted.ok());
  EXPECT_NE(submitted.error().message.find("Bob has changed"), std::string::npos)
      << submitted.error().message;
  must(by(bob, undo()));
  must(by(ann, undo()));
  EXPECT_EQ(list().versions_size(), 0);
}

TEST_F(Versions, U6_RefusedWithTheField) {
  EXPECT_EQ(refused(name_version("")), "invalid_argument name_version.name");
  EXPECT_EQ(refused(name_version(std::string(65, 'x'))), "invalid_argument name_version.name");
  EXPECT_EQ(refused(name_version("a\nb")), "invalid_argument name_version.name");
  EXPECT_EQ(refused(name_version("a", std::string(5000, 'x'))), "invalid_argument name_version.note");
  EXPECT_EQ(refused(name_version("a", "\x01")), "invalid_argument name_version.note");
  must(name_version(std::string(64, 'x'), "two\nlines"));
  EXPECT_EQ(refused(name_version(std::string(64, 'x'))), "already_exists name_version.name");
  EXPECT_EQ(refused(restore("none")), "not_found restore_version.name");
  EXPECT_EQ(refused(delete_version("none")), "not_found delete_version.name");
  EXPECT_EQ(refused(branch("b", "none")), "not_found new_alternative.version");
  v1::Query query;
  query.mutable_difference()->set_from("none");
  EXPECT_EQ(model_.query(query).error().field, "difference.from");
}

TEST(VersionsLimits, U6_OnlySoMany) {
  ApplyContext context;
  context.limits.max_versions = 2;
  Model model({}, context);
  ASSERT_TRUE(model.submit(name_version("1")).ok());
  ASSERT_TRUE(model.submit(name_version("2")).ok());
  EXPECT_EQ(model.submit(name_version("3")).error().code, ErrorCode::resource_exhausted);
}

TEST_F(Versions, U6_TheDifferenceSaysWhoDidWhat) {
  must(by(ann, create("seat")));
  must(by(ann, create("back")));
  must(by(ann, add("seat", saddle_points())));
  must(by(ann, add("back", saddle_points())));
  must(by(ann, name_version("monday")));
  must(by(ann, move("seat", 0.012)));
  std::vector<v1::Point> more;
  for (int i = 0; i < 40; ++i) more.push_back(point(0.001 * i, 0.3, 0.01));
  must(by(bob, add("back", more)));
  must(by(ann, fit("back")));
  must(by(bob, create("arm")));
  must(by(bob, rename("arm", "Arm rest")));
  EXPECT_EQ(sentences("monday"),
            (std::vector<std::string>{"Bob made Arm rest.", "Bob added 40 points to back.",
                                      "Ann fitted a surface to back.", "Ann moved seat by 12 mm."}));
  const v1::DifferenceResult all = difference("monday");
  ASSERT_EQ(all.differences_size(), 3);
  EXPECT_EQ(all.differences(0).entity(), "arm");
  EXPECT_EQ(all.differences(0).words(), "added");
  EXPECT_EQ(all.differences(1).words(), "40 points more, fitted, shown otherwise");
  must(by(ann, name_version("tuesday")));
  must(by(bob, remove("arm")));
  EXPECT_EQ(sentences("monday", "tuesday").size(), 4U) << "what came later is not in between";
  EXPECT_EQ(sentences("tuesday"), std::vector<std::string>{"Bob deleted Arm rest."});
  EXPECT_TRUE(sentences("tuesday", "tuesday").empty());
}

TEST_F(Versions, U6_BothHaveMovedIt) {
  must(by(ann, create("seat")));
  must(by(ann, add("seat", saddle_points())));
  must(by(ann, name_version("1")));
  must(by(ann, move("seat", 0.01)));
  must(by(bob, move("seat", 0.02)));
  EXPECT_EQ(sentences("1"), std::vector<std::string>{"Ann and Bob moved seat by 30 mm."});
  must(by(bob, undo()));
  EXPECT_EQ(sentences("1"), std::vector<std::string>{"Ann moved seat by 10 mm."});
}

TEST_F(Versions, U6_WithoutHistoryItIsSaidWithoutNames) {
  must(by(ann, create("back")));
  must(by(ann, add("back", saddle_points())));
  must(by(ann, name_version("1")));
  v1::Operation turn;
  turn.mutable_transform()->add_entities("back");
  turn.mutable_transform()->mutable_rotation()->set_w(1);
  turn.mutable_transform()->mutable_rotation()->set_z(1);
  turn.mutable_transform()->set_scale(2);
  must(by(ann, turn));
  std::vector<v1::Point> points;
  for (int i = 0; i < 40; ++i) points.push_back(point(0.001 * i, 0.3, 0.01));
  must(by(ann, add("back", points)));
  Model later(model_.document());
  v1::Query query;
  query.mutable_difference()->set_from("1");
  const auto result = later.query(query);
  ASSERT_TRUE(result.ok());
  const auto& sentences = result->difference().sentences();
  EXPECT_EQ(std::vector<std::string>(sentences.begin(), sentences.end()),
            (std::vector<std::string>{"back was turned by 90 degrees.", "back was scaled to 200 %.",
                                      "40 points were added to back."}));
}

// A version's content is in the hash of the document, though it is read only once.
TEST_F(Versions, X2U6_TheHashTellsVersionsApart) {
  must(create("seat"));
  Model other(model_.document());
  must(name_version("1"));
  must(rename("seat", "Seat"));
  ASSERT_TRUE(other.submit(rename("seat", "Seat")).ok());
  ASSERT_TRUE(other.submit(name_version("1")).ok());
  EXPECT_EQ(model_.document().entities.size(), other.document().entities.size());
  EXPECT_NE(document_hash(model_.document()), document_hash(other.document()));
}

}  // namespace
}  // namespace handloft::model
