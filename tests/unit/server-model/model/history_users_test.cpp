// U1: undo per user. It takes back one's own newest step where nobody else has gone on, and says who has
// where somebody did. The invariants, by random operations:
// tests/property/server-model/model/undo_users_test.cpp.

#include <algorithm>
#include <string>

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

constexpr std::uint64_t ann = 11;
constexpr std::uint64_t bob = 12;

v1::Operation by(std::uint64_t client, v1::Operation operation) {
  operation.set_client_id(client);
  operation.set_author(client == ann ? "Ann" : client == bob ? "Bob" : "");
  operation.set_made_ns(1'000 + static_cast<std::int64_t>(client));
  return operation;
}

v1::Operation alternative(const std::string& name) {
  v1::Operation operation;
  operation.mutable_new_alternative()->set_name(name);
  return operation;
}

v1::Operation to(const std::string& name) {
  v1::Operation operation;
  operation.mutable_switch_alternative()->set_name(name);
  return operation;
}

class HistoryOfUsers : public ::testing::Test {
 protected:
  void must(const v1::Operation& operation) {
    const auto submitted = model_.submit(operation);
    ASSERT_TRUE(submitted.ok()) << operation.ShortDebugString() << ": " << submitted.error().describe();
    ASSERT_NE(submitted->sequence, 0U);
  }
  /// The message; nothing has changed.
  std::string refused(const v1::Operation& operation) {
    const std::string hash = document_hash(model_.document());
    const std::size_t steps = model_.history().undo_steps();
    const std::uint64_t sequence = model_.sequence();
    const auto submitted = model_.submit(operation);
    EXPECT_FALSE(submitted.ok());
    EXPECT_EQ(document_hash(model_.document()), hash);
    EXPECT_EQ(model_.history().undo_steps(), steps);
    EXPECT_EQ(model_.sequence(), sequence);
    if (submitted) return {};
    EXPECT_EQ(submitted.error().code, ErrorCode::failed_precondition);
    return submitted.error().message;
  }
  std::string name(const std::string& id) const {
    const EntityPtr entity = model_.document().find(id);
    return entity ? entity->name : "gone";
  }

  Model model_;
};

TEST_F(HistoryOfUsers, U1_EachTakesBackTheirOwnNewestStep) {
  must(by(ann, create("seat")));
  must(by(bob, create("back")));
  must(by(ann, rename("seat", "Seat")));
  must(by(bob, rename("back", "Back")));
  EXPECT_EQ(model_.history().next_undo(ann), "Rename \"seat\" to \"Seat\"");
  EXPECT_EQ(model_.history().undo_steps(ann), 2U);
  must(by(ann, undo()));
  EXPECT_EQ(name("seat"), "seat");
  EXPECT_EQ(name("back"), "Back") << "Bob's";
  must(by(ann, undo()));
  EXPECT_EQ(name("seat"), "gone");
  EXPECT_EQ(refused(by(ann, undo())), "there is nothing to undo");
  EXPECT_EQ(model_.history().redo_steps(ann), 2U);
  EXPECT_EQ(model_.history().redo_steps(bob), 0U);
  must(by(bob, undo()));
  must(by(ann, redo()));
  must(by(ann, redo()));
  EXPECT_EQ(name("seat"), "Seat");
  EXPECT_EQ(name("back"), "back");
  EXPECT_EQ(refused(by(ann, redo())), "there is nothing to redo");
}

// A name that is one's own would read as if oneself had done it, and could take it back.
TEST_F(HistoryOfUsers, U1_WhoHasGoneOnInAnotherProgramOfTheirsIsToldSo) {
  v1::Operation elsewhere = by(bob, rename("seat", "Bench"));
  elsewhere.set_author("Ann");
  must(by(ann, create("seat")));
  must(by(ann, rename("seat", "Seat")));
  must(elsewhere);
  EXPECT_EQ(
      model_.history().undo_refused(ann),
      "\"Rename \"seat\" to \"Seat\"\" is not taken back: another program of yours has changed \"Seat\" "
      "since (Rename \"Seat\" to \"Bench\")");
}

TEST_F(HistoryOfUsers, U1_RefusedWhereSomebodyElseHasGoneOnWithWhoAndWhat) {
  must(by(ann, create("seat")));
  must(by(ann, rename("seat", "Seat")));
  must(by(bob, rename("seat", "Bench")));
  const std::string why =
      "\"Rename \"seat\" to \"Seat\"\" is not taken back: Bob has changed \"Seat\" since (Rename \"Seat\" to "
      "\"Bench\")";
  EXPECT_EQ(model_.history().undo_refused(ann), why);
  EXPECT_EQ(model_.history().undo_refused(bob), "");
  EXPECT_EQ(refused(by(ann, undo())), why);
  // Bob thinks better of it: then Ann may.
  must(by(bob, undo()));
  EXPECT_EQ(model_.history().undo_refused(ann), "");
  must(by(ann, undo()));
  EXPECT_EQ(name("seat"), "seat");
  // And now Bob's own is no longer what he had worked on.
  EXPECT_NE(refused(by(bob, redo())).find("Ann has taken back a change of \"Bench\" since"),
            std::string::npos);
}

TEST_F(HistoryOfUsers, U1_ADeletedEntityOfSomebodyElsesIsNotBroughtBack) {
  must(by(ann, create("seat")));
  must(by(ann, add("seat", saddle_points())));
  must(by(bob, remove("seat")));
  EXPECT_NE(refused(by(ann, undo())).find("Bob has changed \"seat\" since (Delete \"seat\")"),
            std::string::npos);
  must(by(bob, undo()));
  must(by(ann, undo()));
  EXPECT_EQ(model_.document().find_dual("seat")->points.size(), 0U);
}

// What has come back to the value that Ann had left is Bob's work all the same.
TEST_F(HistoryOfUsers, U1_WhatSomebodyElseHasRestoredIsTheirs) {
  must(by(ann, create("seat")));
  must(by(ann, rename("seat", "Seat")));
  must(by(bob, alternative("kept")));
  must(by(bob, to("main")));
  must(by(bob, rename("seat", "Bench")));
  v1::Operation restore;
  restore.mutable_restore_alternative()->set_name("kept");
  must(by(bob, restore));
  EXPECT_EQ(name("seat"), "Seat");
  EXPECT_NE(refused(by(ann, undo())).find("Bob has changed \"Seat\" since (Restore alternative"),
            std::string::npos);
}

TEST_F(HistoryOfUsers, U1_PartnersAreOneStep) {
  must(by(ann, create("a")));
  must(by(ann, symmetry("a", v1::SetSymmetry::PARTNER, -0.1)));
  must(by(ann, add("a", saddle_points())));
  const std::string partner = model_.document().find_dual("a")->partner;
  ASSERT_TRUE(model_.document().find(partner));
  must(by(bob, rename(partner, "Left")));
  const std::string why = refused(by(ann, undo()));
  EXPECT_NE(why.find("Bob has changed \""), std::string::npos) << why;
  EXPECT_TRUE(model_.document().find(partner)) << "the partner that Bob named would have gone";
  must(by(bob, undo()));
  must(by(ann, undo()));
  EXPECT_FALSE(model_.document().find(partner));
}

TEST_F(HistoryOfUsers, U1_AStepOfAnotherAlternativeWaitsUntilThatIsWorkedOn) {
  must(by(ann, create("seat")));
  must(by(bob, alternative("wide")));
  EXPECT_NE(refused(by(ann, undo())).find("Bob has changed which alternative is worked on since"),
            std::string::npos);
  must(by(bob, to("main")));
  must(by(ann, undo()));
  EXPECT_EQ(name("seat"), "gone");
  must(by(bob, to("wide")));
  EXPECT_EQ(name("seat"), "seat") << "there it was kept";
}

TEST_F(HistoryOfUsers, U1_AnAlternativeIsNotTakenBackWithSomebodyElsesWorkInIt) {
  must(by(ann, create("seat")));
  must(by(ann, alternative("wide")));
  must(by(bob, create("arm")));
  EXPECT_NE(refused(by(ann, undo())).find("Bob has changed the alternative \"wide\" since (Create \"arm\")"),
            std::string::npos);
  must(by(bob, undo()));
  must(by(ann, undo()));
  EXPECT_EQ(model_.document().alternatives->size(), 1U);
}

// Switching back hides Bob's work, but keeps it.
TEST_F(HistoryOfUsers, U1_ASwitchIsTakenBackAndKeepsWhatOthersDidMeanwhile) {
  must(by(ann, alternative("wide")));
  must(by(ann, to("main")));
  must(by(bob, create("arm")));
  must(by(ann, undo()));
  EXPECT_EQ(model_.document().present_alternative(), "wide");
  EXPECT_EQ(name("arm"), "gone");
  EXPECT_NE(refused(by(bob, undo()))
                .find("Ann has taken back a change of which alternative is worked on since (Switch to"),
            std::string::npos)
      << "it waits until somebody works there";
  must(by(ann, to("main")));
  EXPECT_EQ(name("arm"), "arm");
  must(by(bob, undo()));
  EXPECT_EQ(name("arm"), "gone");
}

TEST_F(HistoryOfUsers, U1_AnIdThatWasTakenMeanwhileIsNotTakenAgain) {
  must(by(ann, create("seat")));
  must(by(ann, undo()));
  must(by(bob, create("seat", 3)));
  EXPECT_NE(refused(by(ann, redo())).find("Bob has changed \"seat\" since"), std::string::npos);
  must(by(bob, remove("seat")));
  EXPECT_NE(refused(by(ann, redo())).find("Bob has changed \"seat\" since"), std::string::npos);
  EXPECT_EQ(model_.document().find_dual("seat"), nullptr);
}

// An id that is still alive elsewhere is not free.
TEST_F(HistoryOfUsers, U1_AnIdStaysUsedOnceOthersHaveGoneOn) {
  must(by(ann, create("shape-1")));
  must(by(bob, alternative("wide")));
  must(by(bob, to("main")));
  must(by(ann, undo()));
  const auto again = model_.submit(by(ann, create("shape-1")));
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::already_exists);
}

// Found by random cases: Ann's step, the older one, was done again after Bob's was made.
TEST_F(HistoryOfUsers, U1_ANumberThatSomebodyElseHasAgainIsNotFreed) {
  must(by(ann, create("shape-2")));
  must(by(ann, undo()));
  must(by(bob, create("shape-1")));
  must(by(ann, redo()));
  must(by(bob, undo()));
  EXPECT_EQ(model_.document().next_shape, 3U);
  must(by(bob, redo()));
  must(by(ann, undo()));
  const std::string hash = document_hash(model_.document());
  must(by(bob, undo()));
  must(by(bob, redo()));
  EXPECT_EQ(document_hash(model_.document()), hash);
}

// Found by random cases, too.
TEST_F(HistoryOfUsers, U1_AnAlternativeComesAgainWhereItWas) {
  v1::Operation without_main;
  without_main.mutable_delete_alternative()->set_name("main");
  must(by(ann, alternative("wide")));
  must(by(ann, without_main));
  must(by(bob, alternative("narrow")));
  must(by(ann, undo()));
  const std::string hash = document_hash(model_.document());
  must(by(bob, undo()));
  must(by(bob, redo()));
  EXPECT_EQ(document_hash(model_.document()), hash);
}

TEST_F(HistoryOfUsers, U1_ANewStepForgetsOnlyOnesOwnRedo) {
  must(by(ann, create("a")));
  must(by(bob, create("b")));
  must(by(ann, undo()));
  must(by(bob, undo()));
  must(by(ann, create("c")));
  EXPECT_EQ(model_.history().redo_steps(ann), 0U);
  EXPECT_EQ(model_.history().redo_steps(bob), 1U);
  must(by(bob, redo()));
  EXPECT_EQ(name("b"), "b");
  EXPECT_EQ(model_.history().undo_steps(), 2U);
}

TEST_F(HistoryOfUsers, U1_TheHistoryTellsWhoDidWhatAndWhen) {
  must(by(ann, create("seat")));
  must(by(bob, rename("seat", "Seat")));
  must(create("arm"));
  must(by(bob, undo()));
  v1::Query query;
  query.mutable_history();
  const auto result = model_.query(query, bob);
  ASSERT_TRUE(result.ok());
  const v1::HistoryResult& history = result->history();
  ASSERT_EQ(history.steps_size(), 3);
  EXPECT_EQ(history.steps(0).author(), "Ann");
  EXPECT_EQ(history.steps(0).client_id(), ann);
  EXPECT_EQ(history.steps(0).made_ns(), 1'011);
  EXPECT_EQ(history.steps(0).sequence(), 1U);
  EXPECT_TRUE(history.steps(1).undone());
  EXPECT_EQ(history.steps(1).words(), "Rename \"seat\" to \"Seat\"");
  EXPECT_EQ(history.steps(2).client_id(), 0U);
  EXPECT_EQ(history.applied_size(), 2);
  EXPECT_EQ(history.undo_steps(), 0U) << "Bob's";
  EXPECT_EQ(history.redo_steps(), 1U);
  EXPECT_EQ(history.next_redo(), "Rename \"seat\" to \"Seat\"");
}

// D6: the log keeps undo as any operation.
TEST_F(HistoryOfUsers, D6U1_TheLogReplayedGivesTheSameDocument) {
  std::vector<v1::Operation> log;
  const auto logged = [&](const v1::Operation& operation) {
    const auto submitted = model_.submit(operation);
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
    log.push_back(submitted->effective);
  };
  logged(by(ann, create("seat")));
  logged(by(bob, create("back")));
  logged(by(ann, add("seat", saddle_points())));
  logged(by(ann, fit("seat")));
  logged(by(bob, undo()));
  logged(by(ann, undo()));
  logged(by(bob, redo()));
  logged(by(ann, redo()));
  Model again;
  for (const v1::Operation& operation : log) {
    ASSERT_TRUE(again.submit(operation).ok());
    EXPECT_TRUE(operation.author() == "Ann" || operation.author() == "Bob");
  }
  EXPECT_EQ(document_hash(again.document()), document_hash(model_.document()));
  EXPECT_EQ(again.history().undo_steps(ann), 3U);
}

// What others have filled meanwhile is not overfilled.
TEST(HistoryLimits, U1_UndoKeepsToTheLimits) {
  ApplyContext context;
  context.limits.max_entities = 2;
  Model model({}, context);
  for (const v1::Operation& operation :
       {by(ann, create("a")), by(ann, create("b")), by(ann, remove("a")), by(bob, create("c"))}) {
    ASSERT_TRUE(model.submit(operation).ok());
  }
  const std::string hash = document_hash(model.document());
  const auto refused = model.submit(by(ann, undo()));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(document_hash(model.document()), hash);
  ASSERT_TRUE(model.submit(by(bob, undo())).ok());
  EXPECT_TRUE(model.submit(by(ann, undo())).ok());
}

// The rule of logs of format 2; that of now is in history_forgetting_test.cpp.
TEST(HistoryLimits, D8U1_TheOldestStepOfAllWasForgottenFirst) {
  History history({}, 3);
  Document document;
  const auto push = [&](const std::string& id, std::uint64_t client) {
    document = applied(history.current(), {create(id)});
    StepInfo info;
    info.words = id;
    info.client_id = client;
    history.push(document, info, UndoRule::per_user_oldest_first);
  };
  push("a", ann);
  push("b", bob);
  ASSERT_TRUE(history.undo(bob).ok());
  push("c", ann);
  push("d", ann);
  EXPECT_EQ(history.undo_steps(ann), 2U) << "the first is forgotten";
  EXPECT_EQ(history.redo_steps(bob), 1U);
  push("e", ann);
  EXPECT_EQ(history.redo_steps(bob), 0U) << "so is what Bob could redo";
  EXPECT_EQ(history.undo_steps(), 3U);
  EXPECT_FALSE(history.redo(bob).ok());
  while (history.undo(ann)) {
  }
  EXPECT_TRUE(history.current().find("a"));
  EXPECT_FALSE(history.current().find("c"));
}

}  // namespace
}  // namespace handloft::model
