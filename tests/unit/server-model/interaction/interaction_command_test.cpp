// Commands of the palette that a hand gives by name (A25): each does what a touch of its cell does.

#include "tests/unit/server-model/interaction/interaction_fixture.h"

namespace handloft::interaction {
namespace {

class CommandTest : public GestureTest {
 protected:
  CommandAnswer command(PaletteCommand which, std::size_t hand = 0) {
    FrameOutcome outcome;
    CommandAnswer answer = interaction_.command(hand, which, outcome);
    for (const std::string& problem : outcome.problems) problems_.push_back(problem);
    submitted_ = outcome.submitted.size();
    exports_ = outcome.exports.size();
    return answer;
  }
  std::size_t submitted_ = 0;
  std::size_t exports_ = 0;
};

struct State {
  std::string hash, active, symmetry, mode;
  int page = 0;
  bool operator==(const State&) const = default;
};

State state_of(const Interaction& interaction, const model::Model& model) {
  const Modes& modes = interaction.modes();
  return {model::document_hash(model.document()), interaction.active_shape(),
          std::to_string(static_cast<int>(modes.symmetry)),
          std::to_string(static_cast<int>(modes.trim)) + std::to_string(static_cast<int>(modes.tool)) +
              std::to_string(modes.keep_curve) + std::to_string(static_cast<int>(modes.falloff)) +
              std::to_string(modes.degree.value_or(99)) + std::to_string(static_cast<int>(modes.icon_pen)),
          modes.palette_page};
}

TEST_F(CommandTest, A25_every_command_by_name_is_a_touch_of_its_cell) {
  make_plate("plate", {0, 0, 0.1});
  const model::Document start = model_.document();
  for (const PaletteCell& cell : table_palette) {
    const auto play = [&](bool by_touch) {
      model::Model model(start);
      Interaction interaction(model);
      test::HandScript script;
      interaction.select("plate");
      FrameOutcome outcome;
      // To its page first, in both: turning it is a command as well.
      while (!is_on_page(cell, interaction.modes().palette_page)) {
        (void)interaction.command(0, PaletteCommand::next_page, outcome);
      }
      if (by_touch) {
        (void)interaction.on_frame(script.touching(cell.centre_x_m, cell.centre_y_m));
        (void)interaction.on_frame(script.resting({0, 0, 0.5}));
      } else {
        (void)interaction.command(0, cell.command, outcome);
      }
      return state_of(interaction, model);
    };
    EXPECT_EQ(play(true), play(false)) << palette_command_name(cell.command);
  }
}

TEST_F(CommandTest, A25_whichever_page_is_shown) {
  make_plate("plate", {0, 0, 0.1});
  interaction_.select("plate");
  ASSERT_EQ(interaction_.modes().palette_page, first_palette_page);
  EXPECT_TRUE(command(PaletteCommand::sculpt).refusal.empty()) << "of the second page";
  EXPECT_EQ(submitted_, 1U);
}

TEST_F(CommandTest, A25_tells_what_was_done_and_for_a_while_and_why_not) {
  rest();
  const CommandAnswer fit = command(PaletteCommand::fit, 1);
  EXPECT_FALSE(fit.refusal.empty());
  EXPECT_EQ(fit.refused_as, ErrorCode::not_found);
  EXPECT_THAT(interaction_.activity(1).tool, HasSubstr("fit: refused: "));
  EXPECT_EQ(interaction_.activity(0).tool, "") << "not the other hand's";
  make_plate("plate", {0, 0, 0.1}, false);
  interaction_.select("plate");
  EXPECT_TRUE(command(PaletteCommand::fit).refusal.empty());
  rest();
  EXPECT_EQ(interaction_.activity(0).tool, "fit");
  EXPECT_EQ(interaction_.activity(0).entity, "plate");
  for (int i = 0; i < 100; ++i) rest();
  EXPECT_EQ(interaction_.activity(0).tool, "");
}

TEST_F(CommandTest, A25_a_stroke_in_the_air_goes_on) {
  for (int i = 0; i < 5; ++i) send(script_.laying({0.01 * i, 0, 0.1}));
  EXPECT_TRUE(command(PaletteCommand::symmetry).refusal.empty());
  EXPECT_FALSE(command(PaletteCommand::undo).refusal.empty()) << "the stroke is no step of history yet";
  for (int i = 5; i < 9; ++i) send(script_.laying({0.01 * i, 0, 0.1}));
  rest();
  EXPECT_EQ(shape("shape-1").points.size(), 9U);
}

TEST_F(CommandTest, A26_an_export_is_asked_for) {
  EXPECT_TRUE(command(PaletteCommand::export_file).refusal.empty());
  EXPECT_EQ(exports_, 1U);
}

TEST_F(CommandTest, U1_operations_carry_whose_they_are) {
  make_plate("plate", {0, 0, 0.1});
  auto claims = std::make_shared<Claims>();
  Interaction other(model_, {}, claims, 42);
  other.select("plate");
  FrameOutcome outcome;
  (void)other.command(0, PaletteCommand::exponent, outcome);
  ASSERT_EQ(outcome.submitted.size(), 1U);
  EXPECT_EQ(outcome.submitted[0].effective.client_id(), 42U);
  (void)other.command(0, PaletteCommand::representation, outcome);
  ASSERT_EQ(outcome.submitted.size(), 2U);
  EXPECT_EQ(outcome.submitted[1].effective.client_id(), 42U);
  (void)other.on_frame(script_.laying({0, 0, 0.1}));
  EXPECT_EQ(model_.provisional_by("plate"), 42U);
}

TEST_F(CommandTest, U1_two_sources_strokes_promise_different_shapes) {
  auto claims = std::make_shared<Claims>();
  Interaction one(model_, {}, claims, 1);
  Interaction two(model_, {}, claims, 2);
  (void)one.on_frame(script_.laying({0, 0, 0.1}));
  (void)two.on_frame(script_.laying({0, 0.2, 0.1}));
  EXPECT_EQ(one.activity(0).entity, "shape-1");
  EXPECT_EQ(two.activity(0).entity, "shape-2");
  EXPECT_EQ(model_.preview().entities.size(), 2U);
  (void)two.finish();
  (void)one.finish();
  EXPECT_EQ(model_.document().entities.size(), 2U);
  EXPECT_TRUE(claims->shape_ids.empty());
}

}  // namespace
}  // namespace handloft::interaction
