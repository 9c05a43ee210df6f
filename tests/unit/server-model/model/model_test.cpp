// The model: total order, retries, gestures in the air, revisions.

#include "server-model/model/model.h"

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

std::string hash(const Model& model) {
  return document_hash(model.document());
}

TEST(Model, CountsWhatChangedAndOnlyThat) {
  Model model;
  EXPECT_EQ(model.submit(create("top"))->sequence, 1U);
  EXPECT_EQ(model.submit(rename("top", "Top"))->sequence, 2U);
  EXPECT_EQ(model.submit(rename("top", "Top"))->sequence, 0U);
  EXPECT_EQ(model.history().undo_steps(), 2U);
  EXPECT_FALSE(model.submit(rename("side", "Side")).ok());
  EXPECT_EQ(model.submit(undo())->sequence, 3U);
  EXPECT_EQ(model.sequence(), 3U);
}

TEST(Model, A28UndoRestoresEveryBit) {
  Model model;
  std::vector<std::string> hashes{hash(model)};
  for (const auto& operation :
       {create("side"), symmetry("side", v1::SetSymmetry::PARTNER), add("side", saddle_points(0.01)),
        fit("side"), superellipse("side", 4), remove("side-mirror")}) {
    ASSERT_TRUE(model.submit(operation).ok());
    hashes.push_back(hash(model));
  }
  for (std::size_t i = hashes.size() - 1; i-- > 0;) {
    ASSERT_TRUE(model.submit(undo()).ok());
    EXPECT_EQ(hash(model), hashes[i]);
  }
  EXPECT_EQ(model.submit(undo()).error().code, ErrorCode::failed_precondition);
  for (std::size_t i = 1; i < hashes.size(); ++i) {
    const auto redone = model.submit(redo());
    ASSERT_TRUE(redone.ok());
    EXPECT_EQ(hash(model), hashes[i]);
    EXPECT_FALSE(redone->changes.empty());
  }
}

TEST(Model, ARetryAppliesOnce) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")).ok());
  auto operation = add("top", {point(0, 0, 0)});
  operation.set_client_id(7);
  operation.set_client_op_id(1);
  const auto first = model.submit(operation);
  const auto again = model.submit(operation);
  ASSERT_TRUE(first.ok() && again.ok());
  EXPECT_EQ(again->sequence, first->sequence);
  EXPECT_EQ(again->changes.changed, first->changes.changed);
  EXPECT_EQ(model.document().find_dual("top")->points.size(), 1U);
  operation.set_client_id(8);  // Somebody else's number 1.
  ASSERT_TRUE(model.submit(operation).ok());
  EXPECT_EQ(model.document().find_dual("top")->points.size(), 2U);
}

TEST(Model, TheEffectiveOperationsReplayToTheSameHash) {
  Model model;
  Model replayed;
  auto first_stroke = add("", saddle_points(0.01));
  first_stroke.mutable_add_points()->mutable_create();
  for (const auto& operation : {create(""), first_stroke, symmetry("shape-2", v1::SetSymmetry::PARTNER),
                                add("shape-2", saddle_points(0.03)), undo(), redo(), fit("shape-2"), undo(),
                                superellipse("shape-2", 3)}) {
    const auto submitted = model.submit(operation);
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
    ASSERT_TRUE(replayed.submit(submitted->effective).ok());
    EXPECT_EQ(hash(replayed), hash(model));
  }
}

TEST(Model, RevisionsGrowWithEveryChange) {
  Model model;
  EXPECT_EQ(model.revision("top"), 0U);
  ASSERT_TRUE(model.submit(create("top")).ok());
  std::uint64_t last = model.revision("top");
  EXPECT_GT(last, 0U);
  const auto expect_growth = [&] {
    EXPECT_GT(model.revision("top"), last);
    last = model.revision("top");
  };
  ASSERT_TRUE(model.submit(rename("top", "Top")).ok());
  expect_growth();
  ASSERT_TRUE(model.submit(undo()).ok());
  expect_growth();
  const auto gesture = model.begin_provisional(add("top", {point(0, 0, 0)}));
  ASSERT_TRUE(gesture.ok());
  expect_growth();
  ASSERT_TRUE(model.append_provisional(*gesture, std::vector<v1::Point>{point(1, 0, 0)}).ok());
  expect_growth();
  EXPECT_TRUE(model.cancel_provisional(*gesture));
  expect_growth();
  ASSERT_TRUE(model.submit(create("side")).ok());
  EXPECT_EQ(model.revision("top"), last);
}

TEST(Provisional, IsSeenInThePreviewAndNotInTheDocument) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")).ok());
  const std::string before = hash(model);
  const auto gesture = model.begin_provisional(add("top", {}));
  ASSERT_TRUE(gesture.ok());
  EXPECT_FALSE(model.is_provisional("top"));
  ASSERT_TRUE(
      model.append_provisional(*gesture, std::vector<v1::Point>{point(1, 0, 0), point(2, 0, 0)}).ok());
  EXPECT_TRUE(model.is_provisional("top"));
  EXPECT_EQ(hash(model), before);
  EXPECT_EQ(model.preview().find_dual("top")->points.size(), 2U);
  EXPECT_TRUE(model.cancel_provisional(*gesture));
  EXPECT_FALSE(model.cancel_provisional(*gesture));
  EXPECT_EQ(document_hash(model.preview()), before);
}

TEST(Provisional, CommitIsOneStepOfHistory) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")).ok());
  const auto gesture = model.begin_provisional(add("top", {point(0, 0, 0)}));
  ASSERT_TRUE(gesture.ok());
  for (int i = 1; i < 50; ++i) {
    ASSERT_TRUE(model.append_provisional(*gesture, std::vector<v1::Point>{point(0.01 * i, 0, 0)}).ok());
  }
  const std::string preview = document_hash(model.preview());
  const auto committed = model.commit_provisional(*gesture);
  ASSERT_TRUE(committed.ok());
  EXPECT_EQ(hash(model), preview);
  EXPECT_EQ(model.history().undo_steps(), 2U);
  EXPECT_EQ(committed->words, "Add 50 points to \"top\"");
  EXPECT_EQ(committed->effective.add_points().points_size(), 50);
  EXPECT_FALSE(model.commit_provisional(*gesture).ok());
}

TEST(Provisional, PiecesEqualTheWholeInEverySymmetry) {
  for (const auto mode : {v1::SetSymmetry::OFF, v1::SetSymmetry::SAME_SHAPE, v1::SetSymmetry::PARTNER}) {
    auto whole = add("", saddle_points(0.01));
    whole.mutable_add_points()->set_min_spacing_m(0.011);
    whole.mutable_add_points()->mutable_create()->set_degree(3);
    *whole.mutable_add_points()->mutable_symmetry() = symmetry("", mode).set_symmetry();
    auto start = whole;
    start.mutable_add_points()->clear_points();
    auto pieces = Provisional::begin({}, start);
    ASSERT_TRUE(pieces.ok()) << pieces.error().describe();
    for (const auto& one : saddle_points(0.01)) ASSERT_TRUE(pieces->append(std::vector<v1::Point>{one}).ok());
    const auto at_once = apply({}, whole);
    ASSERT_TRUE(at_once.ok());
    EXPECT_EQ(document_hash(pieces->result()), document_hash(at_once->document));
    EXPECT_EQ(pieces->applied().changes.created, at_once->changes.created);
  }
}

TEST(Provisional, ARefusedPointLeavesTheGesture) {
  auto gesture = Provisional::begin(applied({}, {create("top")}), add("top", {point(0, 0, 0)}));
  ASSERT_TRUE(gesture.ok());
  const std::string before = document_hash(gesture->result());
  EXPECT_FALSE(gesture->append(std::vector<v1::Point>{point(1, 0, 0), point(0, 0, 0, 2)}).ok());
  EXPECT_EQ(document_hash(gesture->result()), before);
  EXPECT_EQ(gesture->operation().add_points().points_size(), 1);
}

TEST(Provisional, LivesOnWhenTheBaseChanges) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")).ok());
  const auto gesture = model.begin_provisional(add("top", {point(0, 0, 0)}));
  ASSERT_TRUE(gesture.ok());
  const auto other = model.submit(add("top", {point(5, 0, 0)}));
  ASSERT_TRUE(other.ok());
  EXPECT_TRUE(other->cancelled_gestures.empty());
  const DualPtr shape = model.preview().find_dual("top");
  ASSERT_EQ(shape->points.size(), 2U);
  EXPECT_EQ(shape->points[0].x, 5.0);
  EXPECT_EQ(shape->points[1].stroke, 2U);
}

TEST(Provisional, IsCancelledWithAReasonWhenItsEntityGoes) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")).ok());
  const auto gesture = model.begin_provisional(add("top", {point(0, 0, 0)}));
  ASSERT_TRUE(gesture.ok());
  const auto removed = model.submit(remove("top"));
  ASSERT_TRUE(removed.ok());
  ASSERT_EQ(removed->cancelled_gestures.size(), 1U);
  EXPECT_NE(removed->cancelled_gestures[0].find("not_found"), std::string::npos);
  EXPECT_EQ(model.provisional(*gesture), nullptr);
  EXPECT_EQ(model.append_provisional(*gesture, {}).error().code, ErrorCode::not_found);
}

TEST(Provisional, AnyOperationMayBeUpdatedInTheAir) {
  Model model;
  ASSERT_TRUE(model.submit(create("top")).ok());
  const auto gesture = model.begin_provisional(superellipse("top", 3));
  ASSERT_TRUE(gesture.ok());
  ASSERT_TRUE(model.update_provisional(*gesture, superellipse("top", 4)).ok());
  EXPECT_FALSE(model.update_provisional(*gesture, superellipse("top", 40)).ok());
  EXPECT_FALSE(model.append_provisional(*gesture, std::vector<v1::Point>{point(0, 0, 0)}).ok());
  EXPECT_EQ(model.preview().find_dual("top")->superellipse_exponent, 4.0);
  ASSERT_TRUE(model.commit_provisional(*gesture).ok());
  EXPECT_EQ(model.document().find_dual("top")->superellipse_exponent, 4.0);
}

TEST(Provisional, TheirNumberIsBounded) {
  ApplyContext context;
  context.limits.max_provisional = 2;
  Model model(Document(), context);
  ASSERT_TRUE(model.submit(create("top")).ok());
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(model.begin_provisional(add("top", {})).ok());
  EXPECT_EQ(model.begin_provisional(add("top", {})).error().code, ErrorCode::resource_exhausted);
}

}  // namespace
}  // namespace handloft::model
