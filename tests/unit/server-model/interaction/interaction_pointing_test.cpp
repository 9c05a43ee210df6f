// The pointing hand draws profiles (A18-A21) or boundaries (A24); A25.

#include <numbers>
#include <set>
#include <tuple>

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

// --- A21: one stroke, divided by hand with taps of the thumb

class SplitTest : public PointingTest {
 protected:
  /// The fingertip on its way from one place to another; the thumb lies on its pad in the frames of `laid`.
  void draw_tapping(const Vector3d& from, const Vector3d& to, const std::set<int>& laid, int frames = 40) {
    for (int i = 0; i <= frames; ++i) {
      v1::TrackingFrame frame = script_.pointing(from + (to - from) * i / frames);
      frame.mutable_hands(0)->set_contacts(laid.contains(i) ? 1U << v1::CONTACT_PAD_THUMB : 0U);
      send(frame);
    }
  }
  v1::ProfileCurve commit() {
    const FrameOutcome outcome = rest();
    if (outcome.submitted.size() != 1) return {};
    return outcome.submitted[0].effective.modify_profile().curves(0);
  }
  static std::vector<std::string> owners(const v1::ProfileCurve& curve) {
    return {curve.split_entities().begin(), curve.split_entities().end()};
  }
};

TEST_F(SplitTest, A21_a_tap_of_the_thumb_passes_the_stroke_on_to_the_next_surface) {
  // Two plates, one 2 cm above the other: nothing but the hand can say where the one ends.
  make_plate("lower", {0, 0, 0.1});
  make_plate("upper", {0, 0, 0.12});
  const model::DualPtr lower = model_.document().find_dual("lower");
  const model::DualPtr upper = model_.document().find_dual("upper");
  draw_tapping({-0.04, 0, 0.104}, {0.04, 0, 0.104}, {10, 11, 12});
  EXPECT_EQ(interaction_.activity(0).tool, "drawing a profile, part 2");
  EXPECT_EQ(interaction_.activity(0).entity, "upper") << "what it now edits is what is marked";
  const v1::ProfileCurve curve = commit();
  EXPECT_EQ(owners(curve), (std::vector<std::string>{"lower", "upper"}));
  ASSERT_EQ(curve.split_at_size(), 1) << "held for three frames it is one tap";
  EXPECT_NEAR(curve.split_at(0), 0.25, 1e-9);
  EXPECT_NE(shape("lower").fit->surface, lower->fit->surface);
  EXPECT_NE(shape("upper").fit->surface, upper->fit->surface);
  EXPECT_TRUE(problems_.empty());

  // CHECK of A21: two separate edits give the same.
  const auto lower_after = shape("lower").fit->surface;
  const auto upper_after = shape("upper").fit->surface;
  touch(PaletteCommand::undo);
  for (const auto& [id, from, to] : {std::tuple{"lower", 0, 10}, std::tuple{"upper", 10, 40}}) {
    v1::Operation operation;
    v1::ProfileCurve& part = *operation.mutable_modify_profile()->add_curves();
    part.set_entity(id);
    for (int i = from; i <= to; ++i) *part.add_points() = curve.points(i);
    ASSERT_TRUE(model_.submit(operation).ok());
  }
  const double x = 0.01;
  EXPECT_NEAR(shape("lower").fit->surface.value(x, x), lower_after.value(x, x), 1e-12);
  EXPECT_NEAR(shape("upper").fit->surface.value(x, x), upper_after.value(x, x), 1e-12);
}

TEST_F(SplitTest, A21_without_a_tap_the_same_stroke_divides_itself) {
  make_plate("lower", {0, 0, 0.1});
  make_plate("upper", {0, 0, 0.12});
  const model::DualPtr upper = model_.document().find_dual("upper");
  draw_tapping({-0.04, 0, 0.104}, {0.04, 0, 0.104}, {});
  EXPECT_EQ(commit().entity(), "lower");
  EXPECT_EQ(model_.document().find_dual("upper"), upper);
}

TEST_F(SplitTest, A21_beyond_a_tap_with_no_other_surface_near_the_stroke_is_nobodys) {
  make_plate("plate", {0, 0, 0.1});
  draw_tapping({-0.04, 0, 0.106}, {0.04, 0, 0.106}, {20});
  EXPECT_EQ(interaction_.activity(0).tool, "drawing a profile, part 2 of nothing");
  const v1::ProfileCurve curve = commit();
  EXPECT_EQ(owners(curve), (std::vector<std::string>{"plate", ""}));
  // And back on the plate with another tap.
  draw_tapping({-0.04, 0, 0.106}, {0.04, 0, 0.106}, {10, 30});
  EXPECT_EQ(owners(commit()), (std::vector<std::string>{"plate", "", "plate"}));
}

TEST_F(SplitTest, A21_taps_at_one_place_go_through_the_surfaces_near_it) {
  make_plate("a", {0, 0, 0.1});
  make_plate("b", {0, 0, 0.12});
  make_plate("c", {0, 0, 0.13});
  const Vector3d from(-0.04, 0, 0.104);
  const Vector3d middle(0, 0, 0.104);
  const Vector3d to(0.04, 0, 0.104);
  for (const auto& [taps, expected] :
       std::vector<std::pair<int, std::string>>{{1, "b"}, {2, "c"}, {3, ""}, {4, "b"}}) {
    draw_tapping(from, middle, {}, 20);
    for (int tap = 0; tap < taps; ++tap) draw_tapping(middle, middle, {1}, 2);
    draw_tapping(middle, to, {}, 20);
    const v1::ProfileCurve curve = commit();
    EXPECT_EQ(owners(curve), (std::vector<std::string>{"a", expected})) << taps;
    touch(PaletteCommand::undo);
  }
}

TEST_F(SplitTest, A21_the_first_part_is_the_selected_shapes) {
  make_plate("lower", {0, 0, 0.1});
  make_plate("upper", {0, 0, 0.12});
  interaction_.select("upper");
  draw_tapping({-0.04, 0, 0.104}, {0.04, 0, 0.104}, {20});
  EXPECT_EQ(owners(commit()), (std::vector<std::string>{"upper", "lower"}));
}

TEST_F(SplitTest, a_thumb_that_lies_there_or_taps_without_drawing_divides_nothing) {
  make_plate("plate", {0, 0, 0.1});
  std::set<int> always;
  for (int i = 0; i <= 40; ++i) always.insert(i);
  draw_tapping({-0.04, 0, 0.106}, {0.04, 0, 0.106}, always);
  EXPECT_EQ(commit().split_at_size(), 0);
  v1::TrackingFrame lifted = script_.pointing({0, 0, 0.106}, false);
  send(lifted);
  lifted = script_.pointing({0, 0, 0.106}, false);
  lifted.mutable_hands(0)->set_contacts(1U << v1::CONTACT_PAD_THUMB);
  send(lifted);
  draw_tapping({-0.04, 0, 0.106}, {0.04, 0, 0.106},
               {0});  // and in the first frame there is nothing to divide
  EXPECT_EQ(commit().split_at_size(), 0);
  // Other pads are no thumb.
  for (int i = 0; i <= 40; ++i) {
    v1::TrackingFrame frame = script_.pointing({-0.04 + 0.002 * i, 0, 0.106});
    frame.mutable_hands(0)->set_contacts(i == 20 ? 1U << v1::CONTACT_PAD_LITTLE : 0U);
    send(frame);
  }
  EXPECT_EQ(commit().split_at_size(), 0);
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
