// The palette's cells for sculpting (D16, D18, D19).

#include "tests/unit/server-model/interaction/sculpt_fixture.h"

namespace handloft::interaction {
namespace {

class SculptPaletteTest : public SculptTest {
 protected:
  void pick(const Vector3d& at) {
    send(script_.closed(at));
    rest();
  }
  std::string words(PaletteCommand command) {
    const PaletteCell& cell = palette_cell_of(command);
    while (!is_on_page(cell, interaction_.modes().palette_page)) touch(PaletteCommand::next_page);
    send(script_.touching(cell.centre_x_m, cell.centre_y_m));
    std::string said = interaction_.activity(0).tool;
    rest();
    return said;
  }
};

TEST_F(SculptPaletteTest, sculpt_makes_a_surface_of_the_active_shape_or_a_sheet) {
  touch(PaletteCommand::new_shape);
  FrameOutcome outcome = touch(PaletteCommand::sculpt);
  ASSERT_EQ(outcome.submitted.size(), 1U);
  const std::string flat = outcome.submitted[0].effective.create_sculpt_surface().id();
  EXPECT_EQ(interaction_.active_shape(), flat);
  const model::SculptPtr surface = model::as_sculpt(model_.document().find(flat));
  ASSERT_TRUE(surface);
  EXPECT_NEAR(surface->rest->u.length(), 0.3, 1e-12);
  EXPECT_EQ(surface->rest->u.control_count(), 20);
  EXPECT_THAT(words(PaletteCommand::sculpt), HasSubstr("no shape of points")) << "it is one already";

  make_plate("plate", {0.5, 0, 0.1});
  interaction_.select("plate");
  outcome = touch(PaletteCommand::sculpt);
  ASSERT_EQ(outcome.submitted.size(), 1U);
  EXPECT_EQ(outcome.submitted[0].effective.create_sculpt_surface().fitted(), "plate");
  const std::string fitted = interaction_.active_shape();
  ASSERT_TRUE(model::as_sculpt(model_.document().find(fitted)));

  make_plate("points", {-0.5, 0, 0.1}, false);
  interaction_.select("points");
  outcome = touch(PaletteCommand::sculpt);
  ASSERT_EQ(outcome.submitted.size(), 1U);
  EXPECT_EQ(outcome.submitted[0].effective.create_sculpt_surface().points(), "points");
}

TEST_F(SculptPaletteTest, D18_property_role_and_state_step_round_the_selected_icon) {
  add_icon("p", {{0, 0, sheet_z}});
  pick({0, 0, 0.11});
  using enum model::IconProperty;
  for (const model::IconProperty each : {tangent_u, tangent_v, second_u, second_v, twist, normal, position}) {
    touch(PaletteCommand::icon_property);
    EXPECT_EQ(icon("p").property, each);
  }
  touch(PaletteCommand::icon_role);
  EXPECT_EQ(icon("p").role, model::IconRole::load);
  touch(PaletteCommand::icon_role);
  EXPECT_EQ(icon("p").role, model::IconRole::constraint);
  EXPECT_EQ(words(PaletteCommand::icon_state), "icon \"p\": passive");
  touch(PaletteCommand::icon_state);
  EXPECT_EQ(icon("p").state, model::IconState::sleeping);
  touch(PaletteCommand::icon_state);
  EXPECT_EQ(icon("p").state, model::IconState::driving);
  EXPECT_EQ(interaction_.modes().icon_property, v1::ICON_POSITION) << "new ones stay as they were";
}

TEST_F(SculptPaletteTest, what_is_chosen_is_told_in_words) {
  touch(PaletteCommand::new_shape);
  EXPECT_EQ(interaction_.sculpting_words(), "") << "no sculpted surface is active";
  interaction_.select("sheet");
  EXPECT_EQ(interaction_.sculpting_words(), "new icons: points and curves, position constraints");
  touch(PaletteCommand::icon_role);
  touch(PaletteCommand::icon_pen);
  EXPECT_EQ(interaction_.sculpting_words(), "new icons: regions, loads");
  add_icon("p", {{0, 0, sheet_z}});
  pick({0, 0, 0.11});
  EXPECT_EQ(interaction_.sculpting_words(), "icon \"p\": driving point, position constraint");
  touch(PaletteCommand::icon_role);
  EXPECT_EQ(interaction_.sculpting_words(), "icon \"p\": driving point, load");
  touch(PaletteCommand::icon_stiffness);
  EXPECT_THAT(interaction_.sculpting_words(), HasSubstr("load of "));
}

TEST_F(SculptPaletteTest, D16_stiffness_steps_follow_soft_stiff) {
  add_icon("l", {{0, 0, sheet_z}}, v1::ICON_POINT, v1::ICON_DRIVING, {}, v1::ICON_LOAD);
  pick({0, 0, 0.11});
  for (const double share : {0.5, 2.0, 1.0}) {
    touch(PaletteCommand::icon_stiffness);
    send(script_.closed({0, 0, 0.11}));
    send(script_.closed({0, 0, 0.12}));
    rest();
    EXPECT_NEAR(height(sheet(), 0, 0), share * 0.01, 1e-6) << "of the hand's centimetre";
    touch(PaletteCommand::undo);
  }
  EXPECT_EQ(icon("l").stiffness, 0);
  add_icon("c", {{0.12, 0, sheet_z}});
  pick({0.12, 0, 0.11});
  EXPECT_THAT(words(PaletteCommand::icon_stiffness), HasSubstr("no driving load"));
}

TEST_F(SculptPaletteTest, D19_commit_and_recover) {
  const std::string flat_surface = [&] {
    std::string bits;
    for (const auto& p : sheet()->initial->control)
      bits.append(reinterpret_cast<const char*>(p.data()), sizeof(double) * 3);
    return bits;
  }();
  add_icon("p", {{0, 0, sheet_z}});
  send(script_.closed({0, 0, 0.11}));
  send(script_.closed({0, 0, 0.13}));
  rest();
  touch(PaletteCommand::commit_sculpting);
  EXPECT_NEAR(sheet()->rest->evaluate(0.2, 0.15).z(), sheet_z + 0.02, 1e-9);
  touch(PaletteCommand::recover_sculpting);
  std::string bits;
  for (const auto& p : sheet()->surface->control)
    bits.append(reinterpret_cast<const char*>(p.data()), sizeof(double) * 3);
  EXPECT_EQ(bits, flat_surface);
}

TEST_F(SculptPaletteTest, what_has_nothing_to_act_on_says_so) {
  const std::string then = hash();
  touch(PaletteCommand::new_shape);
  for (const PaletteCommand each :
       {PaletteCommand::icon_state, PaletteCommand::icon_stiffness, PaletteCommand::delete_icon,
        PaletteCommand::commit_sculpting, PaletteCommand::recover_sculpting}) {
    EXPECT_THAT(words(each), HasSubstr("refused")) << palette_cell_of(each).label;
  }
  EXPECT_EQ(hash(), then);
}

TEST_F(SculptPaletteTest, select_next_comes_to_surfaces_too_and_lets_the_icon_go) {
  add_icon("p", {{0, 0, sheet_z}});
  pick({0, 0, 0.11});
  ASSERT_FALSE(interaction_.selected_icon().empty());
  make_plate("plate", {0.5, 0, 0.1});
  touch(PaletteCommand::select_next);
  EXPECT_EQ(interaction_.active_shape(), "plate");
  EXPECT_TRUE(interaction_.selected_icon().empty());
  touch(PaletteCommand::select_next);
  EXPECT_EQ(interaction_.active_shape(), "sheet");
}

}  // namespace
}  // namespace handloft::interaction
