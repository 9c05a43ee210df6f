// U6: comments pinned to a place on the model.

#include <cmath>
#include <string>
#include <vector>

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

constexpr std::uint64_t ann = 11;
constexpr std::uint64_t bob = 12;

v1::Operation by(std::uint64_t client, v1::Operation operation, std::int64_t made_ns = 7) {
  operation.set_client_id(client);
  operation.set_author(client == ann ? "Ann" : client == bob ? "Bob" : "");
  operation.set_made_ns(made_ns);
  return operation;
}

v1::Operation comment_at(const std::string& entity, double x, double y, double z) {
  v1::Operation operation;
  auto& request = *operation.mutable_add_comment();
  request.set_text("too thin");
  request.set_entity(entity);
  request.mutable_place()->set_x(x);
  request.mutable_place()->set_y(y);
  request.mutable_place()->set_z(z);
  return operation;
}

v1::Operation answer_to(const std::string& id) {
  v1::Operation operation;
  operation.mutable_add_comment()->set_text("I see");
  operation.mutable_add_comment()->set_reply_to(id);
  return operation;
}

v1::Operation change(const std::string& id, const std::string& text) {
  v1::Operation operation;
  operation.mutable_change_comment()->set_id(id);
  operation.mutable_change_comment()->set_text(text);
  return operation;
}

v1::Operation resolve(const std::string& id, bool resolved = true) {
  v1::Operation operation;
  operation.mutable_change_comment()->set_id(id);
  operation.mutable_change_comment()->set_resolved(resolved);
  return operation;
}

v1::Operation delete_comment(const std::string& id) {
  v1::Operation operation;
  operation.mutable_delete_comment()->set_id(id);
  return operation;
}

v1::Operation turn(const std::string& id, double scale) {
  v1::Operation operation;
  auto& request = *operation.mutable_transform();
  request.add_entities(id);
  request.mutable_rotation()->set_w(std::sqrt(0.5));
  request.mutable_rotation()->set_z(std::sqrt(0.5));
  request.mutable_pivot();
  request.set_scale(scale);
  request.mutable_translation()->set_z(0.1);
  return operation;
}

class CommentsOf : public ::testing::Test {
 protected:
  void SetUp() override {
    must(create("seat"));
    must(add("seat", saddle_points()));
  }
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
  std::vector<v1::Comment> all(bool resolved = true) const {
    v1::Query query;
    query.mutable_comments()->set_resolved(resolved);
    const v1::CommentsResult result = model_.query(query)->comments();
    return {result.comments().begin(), result.comments().end()};
  }
  void expect_place(double x, double y, double z, double within = 1e-15) const {
    const v1::Vec3 place = all().front().place();
    EXPECT_NEAR(place.x(), x, within);
    EXPECT_NEAR(place.y(), y, within);
    EXPECT_NEAR(place.z(), z, within);
  }

  Model model_;
};

TEST_F(CommentsOf, U6_TellsWhoSaidWhatWhere) {
  EXPECT_EQ(must(by(ann, comment_at("seat", 0.01, 0.02, 0.03))).words, "Comment on \"seat\"");
  const v1::Comment comment = all().front();
  EXPECT_EQ(comment.id(), "comment-1");
  EXPECT_EQ(comment.text(), "too thin");
  EXPECT_EQ(comment.entity(), "seat");
  EXPECT_EQ(comment.author(), "Ann");
  EXPECT_EQ(comment.client_id(), ann);
  EXPECT_EQ(comment.made_ns(), 7);
  EXPECT_EQ(comment.changed_ns(), 0);
  EXPECT_FALSE(comment.resolved());
  expect_place(0.01, 0.02, 0.03);
}

TEST_F(CommentsOf, U6_GoesAlongWhenItsEntityIsTransformed) {
  must(comment_at("seat", 0.01, 0.02, 0.03));
  must(turn("seat", 2));
  expect_place(-0.04, 0.02, 0.16);
  must(turn("seat", 0.5));
  expect_place(-0.01, -0.02, 0.18);
  // Undo and redo bring it back to the bit, whatever others have said meanwhile.
  must(by(bob, comment_at("seat", 0, 0, 0)));
  must(undo());
  must(undo());
  expect_place(0.01, 0.02, 0.03, 0);
  // Bob's was pinned after both turns: it came back by the second one, whose inverse of 0 is -0.1 / 0.5.
  must(turn("seat", 2));
  must(delete_comment("comment-1"));
  expect_place(0, 0, -0.2, 1e-15);
}

TEST_F(CommentsOf, U6_WithTheMirrorImage) {
  must(create("a"));
  must(symmetry("a", v1::SetSymmetry::PARTNER, -0.1));
  must(add("a", saddle_points()));
  const std::string partner = model_.document().find_dual("a")->partner;
  must(comment_at(partner, -0.3, 0.01, 0));
  v1::Operation move;
  move.mutable_transform()->add_entities("a");
  move.mutable_transform()->mutable_translation()->set_x(0.05);
  must(move);
  expect_place(-0.35, 0.01, 0);
}

TEST_F(CommentsOf, U6_StaysWhereItIsWhenTheShapeIsPushedOrFitted) {
  must(comment_at("seat", 0.01, 0.02, 0.03));
  must(fit("seat"));
  must(add("seat", {point(0.3, 0.3, 0.3)}));
  expect_place(0.01, 0.02, 0.03, 0);
}

TEST_F(CommentsOf, U6_StaysAtItsLastPlaceWhenItsEntityIsDeleted) {
  must(comment_at("seat", 0.01, 0.02, 0.03));
  must(turn("seat", 1));
  must(remove("seat"));
  expect_place(-0.02, 0.01, 0.13);
  EXPECT_EQ(all().front().entity(), "");
  must(undo());
  EXPECT_EQ(all().front().entity(), "seat");
  must(undo());
  expect_place(0.01, 0.02, 0.03, 0);
}

TEST_F(CommentsOf, U6_WithoutAPlaceItIsInTheMiddleOfItsEntity) {
  v1::Operation operation = comment_at("seat", 0, 0, 0);
  operation.mutable_add_comment()->clear_place();
  must(operation);
  expect_place(0, 0, 0.5 * (0.01 + 2 * 0.025 * 0.025 + 0.01 - 0.02 * 0.02 + 2 * 0.005 * 0.005), 2e-3);
  v1::Operation nowhere;
  nowhere.mutable_add_comment()->set_text("lost");
  EXPECT_EQ(refused(nowhere), "invalid_argument add_comment.place");
  nowhere.mutable_add_comment()->mutable_place()->set_x(1);
  EXPECT_EQ(must(nowhere).words, "Comment");
}

TEST_F(CommentsOf, U6_AnswersAreWithWhatTheyAnswer) {
  must(by(ann, comment_at("seat", 0.01, 0, 0)));
  must(by(ann, comment_at("", 0.5, 0, 0)));
  EXPECT_EQ(must(by(bob, answer_to("comment-1"))).words, "Answer comment-1");
  must(by(ann, answer_to("comment-3")));
  std::vector<std::string> ids;
  for (const v1::Comment& comment : all()) ids.push_back(comment.id());
  EXPECT_EQ(ids, (std::vector<std::string>{"comment-1", "comment-3", "comment-4", "comment-2"}));
  must(turn("seat", 1));
  EXPECT_NEAR(all()[2].place().y(), 0.01, 1e-15) << "at the place of what it answers";
  must(resolve("comment-1"));
  EXPECT_EQ(all(false).size(), 1U);
  EXPECT_EQ(all(true).size(), 4U);
  EXPECT_EQ(must(resolve("comment-1", false)).words, "Reopen comment-1");
  must(delete_comment("comment-1"));
  ASSERT_EQ(all().size(), 1U) << "with its answers, and theirs";
  must(undo());
  EXPECT_EQ(all().size(), 4U);
}

TEST_F(CommentsOf, U6_OnlyItsAuthorChangesTheWords) {
  must(by(ann, comment_at("seat", 0, 0, 0)));
  EXPECT_EQ(refused(by(bob, change("comment-1", "no"))), "permission_denied change_comment.text");
  must(by(bob, resolve("comment-1")));
  must(by(ann, change("comment-1", "far too thin"), 9));
  EXPECT_EQ(all().front().text(), "far too thin");
  EXPECT_EQ(all().front().changed_ns(), 9);
  // The same user at another device.
  v1::Operation elsewhere = by(ann, change("comment-1", "thin"));
  elsewhere.set_client_id(99);
  must(elsewhere);
  EXPECT_EQ(must(by(ann, change("comment-1", "thin"))).sequence, 0U) << "nothing new";
  // Nobody's name is nobody's proof.
  must(comment_at("seat", 0, 0, 0));
  v1::Operation nameless = change("comment-2", "mine");
  nameless.set_client_id(5);
  EXPECT_EQ(refused(nameless), "permission_denied change_comment.text");
}

TEST_F(CommentsOf, U1U6_ACommentWithSomebodyElsesAnswerIsNotTakenBack) {
  must(by(ann, comment_at("seat", 0, 0, 0)));
  must(by(bob, answer_to("comment-1")));
  const auto refusal = model_.submit(by(ann, undo()));
  ASSERT_FALSE(refusal.ok());
  EXPECT_NE(
      refusal.error().message.find("Bob has changed the comment \"comment-1\" since (Answer comment-1)"),
      std::string::npos)
      << refusal.error().message;
  must(by(bob, undo()));
  must(by(ann, undo()));
  EXPECT_TRUE(all().empty());
  EXPECT_NE(model_.submit(by(bob, redo())).error().message.find("Ann has taken back"), std::string::npos);
}

TEST_F(CommentsOf, U1U6_TakingAMoveBackTakesSomebodyElsesCommentAlong) {
  must(by(ann, turn("seat", 1)));
  must(by(bob, comment_at("seat", 0, 0.01, 0.1)));
  must(by(ann, undo()));
  expect_place(0.01, 0, 0);
}

TEST_F(CommentsOf, U6_RefusedWithTheField) {
  EXPECT_EQ(refused(comment_at("none", 0, 0, 0)), "not_found add_comment.entity");
  EXPECT_EQ(refused(comment_at("seat", std::nan(""), 0, 0)), "invalid_argument add_comment.place.x");
  v1::Operation bad = comment_at("seat", 0, 0, 0);
  bad.mutable_add_comment()->set_text("");
  EXPECT_EQ(refused(bad), "invalid_argument add_comment.text");
  bad.mutable_add_comment()->set_text(std::string(4097, 'x'));
  EXPECT_EQ(refused(bad), "invalid_argument add_comment.text");
  bad.mutable_add_comment()->set_text("\xff");
  EXPECT_EQ(refused(bad), "invalid_argument add_comment.text");
  bad.mutable_add_comment()->set_text("two\nlines");
  bad.mutable_add_comment()->set_id("a b");
  EXPECT_EQ(refused(bad), "invalid_argument add_comment.id");
  bad.mutable_add_comment()->set_id("mine");
  must(bad);
  EXPECT_EQ(refused(bad), "already_exists add_comment.id");
  bad.mutable_add_comment()->set_id("other");
  bad.mutable_add_comment()->set_reply_to("mine");
  EXPECT_EQ(refused(bad), "invalid_argument add_comment.reply_to");
  EXPECT_EQ(refused(answer_to("none")), "not_found add_comment.reply_to");
  EXPECT_EQ(refused(change("none", "x")), "not_found change_comment.id");
  EXPECT_EQ(refused(change("mine", "")), "invalid_argument change_comment.text");
  EXPECT_EQ(refused(delete_comment("none")), "not_found delete_comment.id");
  v1::Operation nothing;
  nothing.mutable_change_comment()->set_id("mine");
  EXPECT_EQ(refused(nothing), "invalid_argument change_comment");
}

TEST(CommentsLimits, U6_OnlySoMany) {
  ApplyContext context;
  context.limits.max_comments = 1;
  Model model({}, context);
  ASSERT_TRUE(model.submit(comment_at("", 0, 0, 0)).ok());
  EXPECT_EQ(model.submit(comment_at("", 0, 0, 0)).error().code, ErrorCode::resource_exhausted);
}

}  // namespace
}  // namespace handloft::model
