// The pointing hand draws profiles (A18-A21) or boundaries (A24); A25.

#include <numbers>

#include "tests/unit/server-model/interaction/interaction_fixture.h"

namespace handloft::interaction {
namespace {

class PointingTest : public GestureTest {
 protected:
  /// Draws from one place to another in `frames` frames and lets go of the pressure.
  void draw(const Vector3d& from, const Vector3d& to, int frames = 20) {
    for (int i = 0; i <= frames; ++i) send(script_.pointing(from + (to - from) * i / frames));
    send(script_.pointing(to, false));
  }
  void draw_circle(const Vector3d& centre, double radius, double turns = 1.0, int frames = 40) {
    for (int i = 0; i <= frames; ++i) {
      const double angle = 2 * std::numbers::pi * turns * i / frames;
      send(script_.pointing(centre + radius * Vector3d(std::cos(angle), std::sin(angle), 0)));
    }
  }
  double height(const std::string& id, double x, double y) {
    const model::DualShape& plate = *preview(id);
    // The plates' frames are nearly level, so that the surface above a place is a step away.
    Vector3d local = plate.fit->frame.to_local({x, y, 0.1});
    for (int i = 0; i < 20; ++i) {
      const Vector3d world = plate.fit->surface.world_point(plate.fit->frame, local.x(), local.y());
      const Vector3d miss = plate.fit->frame.rotation.transpose() * (Vector3d(x, y, world.z()) - world);
      local.x() += miss.x();
      local.y() += miss.y();
    }
    return plate.fit->surface.world_point(plate.fit->frame, local.x(), local.y()).z();
  }
};

TEST_F(PointingTest, A19_the_surface_follows_the_stroke_while_it_is_drawn) {
  make_plate("plate", {0, 0, 0.1});
  const std::string before = hash();
  const std::size_t steps = model_.history().undo_steps();
  const double flat = height("plate", 0, 0);
  draw({-0.05, 0, 0.11}, {0.05, 0, 0.11});
  EXPECT_TRUE(model_.has_provisional());
  EXPECT_EQ(hash(), before);
  EXPECT_GT(height("plate", 0, 0), flat + 0.003);
  EXPECT_EQ(interaction_.activity(0).tool, "drawing a profile");
  EXPECT_EQ(interaction_.activity(0).entity, "plate");
  EXPECT_EQ(interaction_.activity(0).curve.size(), 21U);
  const std::vector<double> residuals = shape("plate").fit->residuals_m;
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
  EXPECT_GT(height("plate", 0, 0), flat + 0.003);
  ASSERT_EQ(shape("plate").points.size(), 121U);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    EXPECT_NEAR(shape("plate").residual_m(i), residuals[i], 1e-9) << "A8";
  }
  EXPECT_TRUE(problems_.empty());
  touch(PaletteCommand::undo);
  EXPECT_EQ(hash(), before);
}

TEST_F(PointingTest, A19_strokes_of_one_pointing_hand_are_one_operation) {
  make_plate("plate", {0, 0, 0.1});
  const std::size_t steps = model_.history().undo_steps();
  draw({-0.05, -0.03, 0.11}, {0.05, -0.03, 0.11});
  draw({-0.05, 0.03, 0.09}, {0.05, 0.03, 0.09});
  draw({-0.05, 0.031, 0.09}, {0.05, 0.031, 0.09});  // oversketched
  EXPECT_GT(height("plate", 0, -0.03), height("plate", 0, 0.03) + 0.004);
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
  EXPECT_EQ(interaction_.statistics().gestures_committed, 1U);
  draw({-0.05, 0, 0.11}, {0.05, 0, 0.11});
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps + 2) << "pointing again is another gesture";
}

TEST_F(PointingTest, a_tap_draws_nothing_and_spoils_nothing) {
  make_plate("plate", {0, 0, 0.1});
  const std::size_t steps = model_.history().undo_steps();
  send(script_.pointing({0, 0, 0.11}));
  send(script_.pointing({0, 0, 0.11}, false));
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps);
  draw({-0.05, 0, 0.11}, {0.05, 0, 0.11});
  send(script_.pointing({0, 0, 0.11}));
  send(script_.pointing({0, 0, 0.11}, false));
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
  EXPECT_TRUE(problems_.empty());
}

TEST_F(PointingTest, A20_keep_curve_leaves_a_tenth_as_many_points) {
  make_plate("plate", {0, 0, 0.1});
  touch(PaletteCommand::keep_curve);
  EXPECT_TRUE(interaction_.modes().keep_curve);
  draw({-0.05, 0, 0.11}, {0.05, 0, 0.11});
  rest();
  EXPECT_EQ(shape("plate").points.size(), 121U + 12U);
}

TEST_F(PointingTest, A21_one_stroke_over_two_surfaces_changes_both) {
  make_plate("left", {-0.06, 0, 0.1});
  make_plate("right", {0.06, 0, 0.1});
  const model::DualPtr left = model_.document().find_dual("left");
  const model::DualPtr right = model_.document().find_dual("right");
  draw({-0.1, 0, 0.11}, {0.1, 0, 0.11}, 40);
  rest();
  EXPECT_NE(shape("left").fit->surface, left->fit->surface);
  EXPECT_NE(shape("right").fit->surface, right->fit->surface);
  // Negative control: with one selected, the other one stays.
  interaction_.select("left");
  const model::DualPtr stays = model_.document().find_dual("right");
  draw({-0.1, 0, 0.12}, {0.1, 0, 0.12}, 40);
  rest();
  EXPECT_EQ(model_.document().find_dual("right"), stays);
}

TEST_F(PointingTest, a_stroke_for_a_shape_without_a_surface_is_refused_once) {
  make_plate("plate", {0, 0, 0.1}, false);
  interaction_.select("plate");
  const std::string before = hash();
  draw({-0.05, 0, 0.11}, {0.05, 0, 0.11});
  EXPECT_THAT(interaction_.activity(0).tool, HasSubstr("profile: refused"));
  rest();
  ASSERT_EQ(problems_.size(), 1U);
  EXPECT_THAT(problems_[0], HasSubstr("no surface"));
  EXPECT_EQ(hash(), before);
}

TEST_F(PointingTest, a_lost_hand_takes_all_strokes_back) {
  make_plate("plate", {0, 0, 0.1});
  const std::string before = hash();
  draw({-0.05, 0, 0.11}, {0.05, 0, 0.11});
  draw({-0.05, 0.02, 0.11}, {0.05, 0.02, 0.11});
  for (int i = 0; i < 10; ++i) send(script_.empty());
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(hash(), before);
  EXPECT_EQ(interaction_.activity(0).tool, "hand lost");
}

TEST_F(PointingTest, a_changed_base_does_not_break_the_strokes) {
  make_plate("plate", {0, 0, 0.1});
  draw({-0.05, 0, 0.11}, {0.05, 0, 0.11});
  v1::Operation operation;
  operation.mutable_set_superellipse()->set_entity("plate");
  operation.mutable_set_superellipse()->set_exponent(5.0);
  ASSERT_TRUE(model_.submit(operation).ok());
  draw({-0.05, 0.02, 0.11}, {0.05, 0.02, 0.11});
  rest();
  EXPECT_EQ(shape("plate").superellipse_exponent, 5.0);
  EXPECT_GT(height("plate", 0, 0), 0.103);
}

TEST_F(PointingTest, A24_a_closed_curve_trims_the_surface) {
  make_plate("plate", {0, 0, 0.1});
  touch(PaletteCommand::trim_mode);
  EXPECT_EQ(interaction_.modes().trim, TrimMode::boundary);
  const std::size_t steps = model_.history().undo_steps();
  const std::string before = hash();
  draw_circle({0, 0, 0.11}, 0.03, 0.5);
  EXPECT_FALSE(model_.has_provisional()) << "half a circle closes nothing";
  EXPECT_EQ(interaction_.activity(0).tool, "drawing a boundary: open");
  rest();
  EXPECT_EQ(hash(), before);
  ASSERT_EQ(problems_.size(), 1U);
  EXPECT_THAT(problems_[0], HasSubstr("boundary refused"));
  EXPECT_THAT(interaction_.activity(0).tool, HasSubstr("boundary: refused")) << "read for a while";
  draw_circle({0, 0, 0.11}, 0.03, 0.97);
  EXPECT_TRUE(model_.has_provisional());
  EXPECT_EQ(interaction_.activity(0).tool, "drawing a boundary");
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
  EXPECT_NE(hash(), before);
  EXPECT_EQ(problems_.size(), 1U);
}

TEST_F(PointingTest, A24_the_last_boundary_drawn_counts_and_a_lost_hand_leaves_none) {
  make_plate("plate", {0, 0, 0.1});
  touch(PaletteCommand::trim_mode);
  const std::string before = hash();
  draw_circle({0, 0, 0.11}, 0.03);
  for (int i = 0; i < 10; ++i) send(script_.empty());
  EXPECT_EQ(hash(), before);
  draw_circle({0, 0, 0.11}, 0.03);
  rest();
  const std::string alone = hash();
  touch(PaletteCommand::undo);
  draw_circle({0, 0, 0.11}, 0.05);
  send(script_.pointing({0.05, 0, 0.11}, false));
  draw_circle({0, 0, 0.11}, 0.03);
  send(script_.pointing({0.03, 0, 0.11}, false));
  send(script_.pointing({0.03, 0, 0.11}));  // a tap
  rest();
  EXPECT_EQ(hash(), alone);
}

}  // namespace
}  // namespace handloft::interaction
