// U1: which steps a full history forgets, by hand, and what stays of them. By random operations:
// tests/property/server-model/model/forgetting_test.cpp.

#include <fmt/format.h>

#include <map>
#include <string>

#include "server-model/model/document_codec.h"
#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

constexpr std::uint64_t ann = 11;
constexpr std::uint64_t bob = 12;
constexpr std::uint64_t cem = 13;
constexpr std::uint64_t script = 0;

v1::Operation by(std::uint64_t client, v1::Operation operation) {
  operation.set_client_id(client);
  operation.set_author(client == ann ? "Ann" : client == bob ? "Bob" : "");
  return operation;
}

ApplyContext with_steps(std::size_t most) {
  ApplyContext context;
  context.limits.max_history_steps = most;
  return context;
}

class FullHistory : public ::testing::Test {
 protected:
  void must(std::uint64_t client, const v1::Operation& operation) {
    const auto submitted = model_.submit(by(client, operation));
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
  }
  /// New entities.
  void make(std::uint64_t client, int count) {
    for (int i = 0; i < count; ++i) must(client, create(fmt::format("e{}", ++made_)));
  }
  std::size_t steps(std::uint64_t client) const { return model_.history().undo_steps(client); }
  std::string refused(std::uint64_t client) {
    const auto submitted = model_.submit(by(client, undo()));
    return submitted ? std::string() : submitted.error().message;
  }
  /// As after a restart from a snapshot of so many steps.
  void restart(std::size_t most) {
    EncodeOptions options;
    options.max_steps = most;
    std::map<std::string, std::string, std::less<>> beside;
    const auto bytes = encode_state(
        {model_.history(), model_.sequence()},
        [&](std::string_view hash, std::string_view content) {
          beside.emplace(hash, content);
          return Status();
        },
        options);
    ASSERT_TRUE(bytes.ok());
    auto state = decode_state(
        *bytes, [&](std::string_view hash) -> Result<std::string> { return beside.find(hash)->second; },
        model_.limits().max_history_steps);
    ASSERT_TRUE(state.ok()) << state.error().describe();
    model_ = Model::restored({std::move(state->history), state->sequence, {}},
                             with_steps(model_.limits().max_history_steps));
  }

  Model model_{Document(), with_steps(12)};
  int made_ = 0;
};

TEST_F(FullHistory, U1_ForgetsAStepOfWhoHasMost) {
  make(ann, 3);
  make(script, 9);
  EXPECT_EQ(steps(ann), 3U);
  EXPECT_EQ(steps(script), 9U);
  make(script, 100);
  EXPECT_EQ(steps(ann), 3U);
  EXPECT_EQ(steps(script), 9U) << "its own";
  make(bob, 6);
  EXPECT_EQ(steps(ann), 3U);
  EXPECT_EQ(steps(bob), 4U) << "his own from where he has as many as the script";
  EXPECT_EQ(steps(script), 5U);
  // Three share 12: each keeps four, whoever goes on.
  make(ann, 3);
  EXPECT_EQ(steps(ann), 4U);
  EXPECT_EQ(steps(bob), 4U);
  EXPECT_EQ(steps(script), 4U);
  make(script, 50);
  EXPECT_EQ(steps(ann), 4U);
  EXPECT_EQ(steps(bob), 4U);
  EXPECT_EQ(steps(script), 4U);
  EXPECT_EQ(model_.history().entries().size(), 12U);
}

TEST_F(FullHistory, U1_WhoHasTakenBackAllLosesTheLastToBeDoneAgain) {
  model_ = Model(Document(), with_steps(3));
  make(ann, 3);
  for (int i = 0; i < 3; ++i) must(ann, undo());
  make(bob, 1);
  EXPECT_EQ(model_.history().redo_steps(ann), 2U);
  EXPECT_EQ(model_.history().next_redo(ann), "Create \"e1\"") << "what was taken back last";
  must(ann, redo());
  must(ann, redo());
  EXPECT_EQ(model_.history().redo_steps(ann), 0U);
  EXPECT_EQ(model_.history().next_undo(ann), "Create \"e2\"");
}

TEST_F(FullHistory, U1_MoreUsersThanStepsLoseTheirOnlyOneToTheNewest) {
  model_ = Model(Document(), with_steps(2));
  make(ann, 1);
  make(bob, 1);
  make(cem, 1);
  EXPECT_EQ(steps(cem), 1U);
  EXPECT_EQ(steps(ann) + steps(bob), 1U);
}

// The value is again as Ann had left it, and Bob has brought it back: also when nobody remembers that step.
TEST_F(FullHistory, U1_AForgottenStepIsStillInTheWay) {
  must(ann, create("seat"));
  must(bob, remove("seat"));
  must(bob, undo());
  EXPECT_EQ(model_.history().undo_refused(ann), "") << "nobody has gone on";
  v1::Operation named;
  named.mutable_name_version()->set_name("draft");
  must(bob, named);
  must(bob, rename("seat", "Bench"));
  v1::Operation restore;
  restore.mutable_restore_version()->set_name("draft");
  must(bob, restore);
  EXPECT_NE(model_.history().undo_refused(ann).find("Bob has changed \"seat\" since"), std::string::npos)
      << model_.history().undo_refused(ann);
  const std::string gone = "\"Create \"seat\"\" is not taken back: somebody has changed \"seat\" since";
  restart(2);
  EXPECT_EQ(steps(bob), 1U);
  EXPECT_EQ(steps(ann), 1U);
  EXPECT_NE(refused(ann), "");
  make(bob, 30);
  EXPECT_EQ(steps(ann), 1U);
  EXPECT_EQ(model_.history().undo_refused(ann), gone);
  EXPECT_EQ(refused(ann), gone);
  restart(4);
  EXPECT_EQ(refused(ann), gone);
}

TEST_F(FullHistory, U1_ASnapshotKeepsTheNewestOfEach) {
  make(ann, 2);
  make(script, 8);
  for (int i = 0; i < 4; ++i) must(script, undo());
  make(bob, 1);
  restart(5);
  EXPECT_EQ(steps(ann), 2U);
  EXPECT_EQ(steps(bob), 1U);
  EXPECT_EQ(steps(script), 2U) << "(5 - 2 - 1) of 4";
  EXPECT_EQ(model_.history().redo_steps(script), 4U);
  EXPECT_EQ(model_.history().next_redo(script), "Create \"e7\"");
  EXPECT_EQ(model_.history().next_undo(script), "Create \"e6\"");
  // 2 + 8 + 1 still count: one more has room, and only one.
  make(bob, 1);
  EXPECT_EQ(steps(script) + model_.history().redo_steps(script), 6U);
  make(bob, 2);
  EXPECT_EQ(steps(script), 2U) << "two of those that were left out";
  EXPECT_EQ(steps(bob), 4U);
}

// Every run of a script is a client of its own: soon there are more of them than a snapshot has steps.
TEST_F(FullHistory, U1_ASnapshotOfMoreClientsThanStepsKeepsTheLatestOfThem) {
  make(ann, 2);
  for (std::uint64_t run = 100; run < 108; ++run) make(run, 1);
  make(bob, 1);
  restart(4);
  EXPECT_EQ(steps(bob), 1U);
  for (std::uint64_t run = 100; run < 108; ++run) EXPECT_EQ(steps(run), run < 105 ? 0U : 1U) << run;
  EXPECT_EQ(steps(ann), 0U);
  must(bob, undo());
  // What cannot be shared out equally goes to who was at it last.
  make(bob, 5);
  restart(5);
  EXPECT_EQ(steps(bob), 2U) << "5 among bob and three runs";
  for (std::uint64_t run = 105; run < 108; ++run) EXPECT_EQ(steps(run), 1U) << run;
}

}  // namespace
}  // namespace handloft::model
