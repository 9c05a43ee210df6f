// A28: undo and redo restore bit-identical state.

#include "server-model/model/history.h"

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

StepInfo info(const std::string& words) {
  StepInfo step;
  step.words = words;
  return step;
}

TEST(History, StepsBackAndForth) {
  const Document empty;
  const Document one = applied(empty, {create("a")});
  const Document two = applied(one, {create("b")});
  History history(empty);
  EXPECT_FALSE(history.undo().ok());
  EXPECT_FALSE(history.redo().ok());
  history.push(one, info("Create a"));
  history.push(two, info("Create b"));
  EXPECT_EQ(history.next_undo(), "Create b");
  EXPECT_EQ(history.next_redo(), "");
  EXPECT_EQ(*history.undo(), "Create b");
  EXPECT_EQ(document_hash(history.current()), document_hash(one));
  EXPECT_EQ(history.next_redo(), "Create b");
  EXPECT_EQ(*history.undo(), "Create a");
  EXPECT_EQ(document_hash(history.current()), document_hash(empty));
  EXPECT_EQ(history.undo().error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(*history.redo(), "Create a");
  EXPECT_EQ(*history.redo(), "Create b");
  EXPECT_EQ(document_hash(history.current()), document_hash(two));
}

TEST(History, ANewStepForgetsWhatCouldBeRedone) {
  History history;
  history.push(applied({}, {create("a")}), info("a"));
  ASSERT_TRUE(history.undo().ok());
  history.push(applied({}, {create("b")}), info("b"));
  EXPECT_EQ(history.redo_steps(), 0U);
  EXPECT_EQ(history.undo_steps(), 1U);
  EXPECT_TRUE(history.current().find_dual("b"));
}

TEST(History, ForgetsTheOldestBeyondItsBound) {
  History history({}, 2);
  Document document;
  for (const char* id : {"a", "b", "c"}) {
    document = applied(document, {create(id)});
    history.push(document, info(id));
  }
  EXPECT_EQ(history.undo_steps(), 2U);
  ASSERT_TRUE(history.undo().ok());
  ASSERT_TRUE(history.undo().ok());
  EXPECT_FALSE(history.undo().ok());
  EXPECT_TRUE(history.current().find_dual("a"));
  EXPECT_FALSE(history.current().find_dual("b"));
}

}  // namespace
}  // namespace handloft::model
