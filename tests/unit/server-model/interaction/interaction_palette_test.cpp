// The palette on the table (A25): its layout, and what each cell does.

#include <algorithm>
#include <limits>
#include <set>

#include "tests/unit/server-model/interaction/interaction_fixture.h"

namespace handloft::interaction {
namespace {

class PaletteTest : public GestureTest {};

TEST(PaletteLayoutTest, every_command_has_one_cell_a_label_and_a_sign) {
  std::set<PaletteCommand> commands;
  std::set<std::string_view> labels;
  for (const PaletteCell& cell : table_palette) {
    commands.insert(cell.command);
    labels.insert(cell.label);
    EXPECT_FALSE(cell.label.empty());
    EXPECT_FALSE(cell.sign.empty());
    EXPECT_EQ(palette_command_at(cell.centre_x_m, cell.centre_y_m, std::max(1, cell.page)), cell.command);
    EXPECT_EQ(&palette_cell_of(cell.command), &cell);
  }
  EXPECT_EQ(commands.size(), table_palette.size());
  EXPECT_EQ(labels.size(), table_palette.size());
  EXPECT_EQ(commands.size(), static_cast<std::size_t>(PaletteCommand::delete_icon) + 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(palette_command_at(nan, 0.06, first_palette_page));
}

TEST(PaletteLayoutTest, cells_do_not_touch_and_are_within_reach) {
  constexpr double reach_m = 0.33;       // of a hand about the table's origin
  constexpr double clearance_m = 0.009;  // between two cells: a palm on one is not on the other
  for (const PaletteCell& a : table_palette) {
    EXPECT_LT(std::hypot(a.centre_x_m, a.centre_y_m), reach_m) << a.label;
    for (const PaletteCell& b : table_palette) {
      if (&a == &b || (a.page != b.page && a.page != 0 && b.page != 0)) continue;
      const double gap = std::max(std::abs(a.centre_x_m - b.centre_x_m) - (a.width_m + b.width_m) / 2,
                                  std::abs(a.centre_y_m - b.centre_y_m) - (a.height_m + b.height_m) / 2);
      EXPECT_GE(gap, clearance_m) << a.label << ", " << b.label;
    }
  }
}

TEST(PaletteLayoutTest, every_page_has_cells_and_is_reached_by_turning) {
  EXPECT_EQ(palette_cell_of(PaletteCommand::next_page).page, 0) << "there is always a way on";
  EXPECT_EQ(palette_cell_of(PaletteCommand::undo).page, 0);
  EXPECT_GE(palette_pages, 2);
  int page = first_palette_page;
  for (int turned = 0; turned < palette_pages; ++turned) {
    EXPECT_EQ(page, first_palette_page + turned);
    EXPECT_TRUE(std::any_of(table_palette.begin(), table_palette.end(),
                            [&](const PaletteCell& cell) { return cell.page == page; }));
    page = palette_page_after(page);
  }
  EXPECT_EQ(page, first_palette_page);
  for (const int wrong : {-1, 0, palette_pages + 7}) EXPECT_EQ(palette_page_after(wrong), first_palette_page);
}

TEST(PaletteLayoutTest, a_place_means_what_the_page_shows_there) {
  const PaletteCell& falloff = palette_cell_of(PaletteCommand::falloff);
  const auto at = [&](int page) { return palette_command_at(falloff.centre_x_m, falloff.centre_y_m, page); };
  EXPECT_EQ(at(falloff.page), PaletteCommand::falloff);
  EXPECT_EQ(at(first_palette_page), PaletteCommand::trim_mode);
  EXPECT_EQ(at(palette_pages + 1), std::nullopt);
  // What every shape needs is on every page.
  const PaletteCell& fit = palette_cell_of(PaletteCommand::fit);
  EXPECT_EQ(palette_command_at(fit.centre_x_m, fit.centre_y_m, falloff.page), PaletteCommand::fit);
}

TEST_F(PaletteTest, more_turns_the_page_and_a_touch_means_the_page_shown) {
  const PaletteCell& falloff = palette_cell_of(PaletteCommand::falloff);
  ASSERT_EQ(interaction_.modes().palette_page, first_palette_page);
  touch(PaletteCommand::next_page);
  EXPECT_EQ(interaction_.modes().palette_page, 2);
  for (int i = 0; i < 3; ++i) send(script_.touching(falloff.centre_x_m, falloff.centre_y_m));
  EXPECT_EQ(interaction_.activity(0).tool, "falloff: smooth");
  rest();
  EXPECT_EQ(interaction_.modes().falloff, v1::FALLOFF_SMOOTH);
  for (int i = 1; i < palette_pages; ++i) touch(PaletteCommand::next_page);
  EXPECT_EQ(interaction_.modes().palette_page, first_palette_page);
  send(script_.touching(falloff.centre_x_m, falloff.centre_y_m));
  EXPECT_EQ(interaction_.modes().falloff, v1::FALLOFF_SMOOTH) << "another command is there on this page";
  rest();
  touch(PaletteCommand::falloff);
  EXPECT_EQ(interaction_.modes().falloff, v1::FALLOFF_LITERAL);
  EXPECT_TRUE(model_.document().entities.empty());
}

TEST_F(PaletteTest, every_cell_touched_on_an_empty_table_is_safe) {
  for (const PaletteCell& cell : table_palette) touch(cell.command);
  // Some turned pages on the way.
  EXPECT_GE(interaction_.statistics().commands, table_palette.size());
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(model_.document().entities.size(), 1U) << "the sheet that \"Sculpt\" begins with";
}

TEST_F(PaletteTest, A4_degree_cycles_through_1_to_6_and_automatic) {
  make_plate("plate", {0, 0, 0.1});
  interaction_.select("plate");
  const std::size_t steps = model_.history().undo_steps();
  for (const std::uint32_t degree : {3U, 4U, 5U, 6U}) {
    touch(PaletteCommand::degree);
    EXPECT_EQ(shape("plate").requested_degree, degree);
    EXPECT_EQ(shape("plate").fit->requested_degree, degree) << "fitted anew at once";
  }
  EXPECT_EQ(model_.history().undo_steps(), steps + 4);
  const FrameOutcome outcome = touch(PaletteCommand::degree);
  EXPECT_EQ(interaction_.modes().degree, 0U);
  ASSERT_EQ(outcome.submitted.size(), 1U);
  EXPECT_TRUE(outcome.submitted[0].effective.fit().automatic_degree() ||
              outcome.submitted[0].effective.fit().degree() > 0);
  touch(PaletteCommand::degree);
  EXPECT_EQ(shape("plate").requested_degree, 1U);
}

TEST_F(PaletteTest, degree_before_the_first_stroke_is_that_of_the_new_shape) {
  touch(PaletteCommand::degree);
  send(script_.laying({0, 0, 0.1}));
  rest();
  EXPECT_EQ(shape("shape-1").requested_degree, 3U);
}

TEST_F(PaletteTest, A22_exponent_steps_and_follows_the_potentiometer_as_one_operation) {
  make_plate("plate", {0, 0, 0.1});
  interaction_.select("plate");
  const std::size_t steps = model_.history().undo_steps();
  for (const double exponent : {3.0, 5.0, 10.0, 0.5, 1.0, 2.0}) {
    touch(PaletteCommand::exponent);
    EXPECT_EQ(shape("plate").superellipse_exponent, exponent);
  }
  EXPECT_EQ(model_.history().undo_steps(), steps + 6);
  const PaletteCell& cell = palette_cell_of(PaletteCommand::exponent);
  const auto dial = [&](double value) {
    send(HandScript::with_potentiometer(script_.touching(cell.centre_x_m, cell.centre_y_m), value));
  };
  const std::string before = hash();
  dial(0.5);
  dial(0.51);  // its noise
  EXPECT_EQ(preview("plate")->superellipse_exponent, 3.0);
  for (const double value : {0.6, 0.8, 1.0}) dial(value);
  EXPECT_DOUBLE_EQ(preview("plate")->superellipse_exponent, 20.0);
  EXPECT_EQ(hash(), before) << "in the air while the hand lies there";
  dial(0.0);
  EXPECT_DOUBLE_EQ(preview("plate")->superellipse_exponent, 0.2);
  rest();
  EXPECT_DOUBLE_EQ(shape("plate").superellipse_exponent, 0.2);
  EXPECT_EQ(model_.history().undo_steps(), steps + 7);
  dial(0.5);
  for (int i = 0; i < 10; ++i) send(script_.empty());
  EXPECT_DOUBLE_EQ(shape("plate").superellipse_exponent, 0.2) << "a lost hand leaves no trace";
  EXPECT_FALSE(model_.has_provisional());
}

TEST_F(PaletteTest, select_next_goes_through_all_shapes_and_nearest_ends_it) {
  make_plate("a", {0, 0, 0.1}, false);
  make_plate("b", {0.2, 0, 0.1}, false);
  EXPECT_EQ(interaction_.active_shape(), "");
  touch(PaletteCommand::select_next);
  EXPECT_EQ(interaction_.active_shape(), "a");
  touch(PaletteCommand::select_next);
  EXPECT_EQ(interaction_.active_shape(), "b");
  send(script_.resting({0, 0, 0.12}));
  EXPECT_EQ(interaction_.targets(), std::vector<std::string>{"b"}) << "selected, wherever the hand is";
  touch(PaletteCommand::select_next);
  EXPECT_EQ(interaction_.active_shape(), "");
  send(script_.resting({0, 0, 0.12}));
  EXPECT_EQ(interaction_.targets(), std::vector<std::string>{"a"}) << "nothing selected: the nearest";
  touch(PaletteCommand::select_next);
  touch(PaletteCommand::select_nearest);
  send(script_.resting({0.2, 0, 0.12}));
  EXPECT_EQ(interaction_.targets(), std::vector<std::string>{"b"});
}

TEST_F(PaletteTest, strokes_go_to_the_selected_shape) {
  make_plate("a", {0, 0, 0.1}, false);
  send(script_.laying({0.3, 0, 0.1}));
  rest();
  EXPECT_EQ(shape("shape-1").points.size(), 1U);
  touch(PaletteCommand::select_next);
  send(script_.laying({0.3, 0, 0.1}));
  rest();
  EXPECT_EQ(shape("a").points.size(), 122U);
}

TEST_F(PaletteTest, both_shows_points_and_surface_and_lets_the_fit_follow_the_hand) {
  make_plate("plate", {0, 0, 0.1});
  interaction_.select("plate");
  touch(PaletteCommand::representation);
  EXPECT_EQ(shape("plate").representation, model::Representation::points);
  touch(PaletteCommand::both);
  EXPECT_EQ(shape("plate").representation, model::Representation::both);
  for (int i = 0; i < 5; ++i) send(script_.laying({0.01 * i, 0.06, 0.12}));
  rest();
  EXPECT_FALSE(shape("plate").stale) << "A10: fitted with them, in its frozen frame";
}

TEST_F(PaletteTest, A5_refit_plane_takes_the_plane_of_the_present_points) {
  make_plate("plate", {0, 0, 0.1});
  interaction_.select("plate");
  for (int i = 0; i < 60; ++i) send(script_.laying({0.001 * i, 0.02, 0.2 + 0.001 * i}, 1.0));
  rest();
  const Vector3d before = shape("plate").fit->frame.normal();
  touch(PaletteCommand::refit_plane);
  EXPECT_GT((shape("plate").fit->frame.normal() - before).norm(), 1e-3);
  EXPECT_TRUE(problems_.empty());
}

TEST_F(PaletteTest, duplicate_lies_beside_its_original_and_is_acted_on_then) {
  make_plate("plate", {0, 0, 0.1});
  interaction_.select("plate");
  touch(PaletteCommand::duplicate);
  const std::string copy = interaction_.active_shape();
  EXPECT_NE(copy, "plate");
  ASSERT_TRUE(model_.document().find_dual(copy));
  const Vector3d moved = shape(copy).points[0].position() - shape("plate").points[0].position();
  EXPECT_NEAR((moved - Vector3d(0, 0.03, 0)).norm(), 0, 1e-12);
}

TEST_F(PaletteTest, delete_takes_the_active_shape_and_undo_brings_it_back) {
  make_plate("plate", {0, 0, 0.1});
  const std::string before = hash();
  interaction_.select("plate");
  touch(PaletteCommand::erase);
  EXPECT_TRUE(model_.document().entities.empty());
  touch(PaletteCommand::undo);
  EXPECT_EQ(hash(), before);
  EXPECT_EQ(interaction_.active_shape(), "plate");
}

TEST_F(PaletteTest, A28_alternatives_are_made_and_gone_through) {
  make_plate("plate", {0, 0, 0.1}, false);
  interaction_.select("plate");
  touch(PaletteCommand::next_alternative);
  EXPECT_THAT(interaction_.statistics().refused, 1U) << "there is no other one";
  touch(PaletteCommand::new_alternative);
  const std::string second = model_.document().present_alternative();
  EXPECT_NE(second, "main");
  touch(PaletteCommand::erase);
  EXPECT_TRUE(model_.document().entities.empty());
  touch(PaletteCommand::next_alternative);
  EXPECT_EQ(model_.document().present_alternative(), "main");
  EXPECT_EQ(model_.document().entities.size(), 1U);
  touch(PaletteCommand::next_alternative);
  EXPECT_EQ(model_.document().present_alternative(), second);
}

TEST_F(PaletteTest, export_is_left_to_the_session) {
  const std::uint64_t sequence = model_.sequence();
  const FrameOutcome outcome = touch(PaletteCommand::export_file);
  EXPECT_EQ(outcome.exports.size(), 1U);
  EXPECT_EQ(model_.sequence(), sequence);
}

}  // namespace
}  // namespace handloft::interaction
