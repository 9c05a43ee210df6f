// The closed hand pushes with the modification disk (A13, A14, A16, A25).

#include "tests/unit/server-model/interaction/interaction_fixture.h"

namespace handloft::interaction {
namespace {

class PushTest : public GestureTest {
 protected:
  /// Moves a fist down through the plate's middle in `frames` frames, from 60 mm above it to 5 mm below.
  void push_down(int frames, double potentiometer = 0.0, double x = 0.0) {
    for (int i = 0; i <= frames; ++i) {
      send(script_.closed({x, 0.0, 0.16 - 0.065 * i / frames}, 0.2, potentiometer));
    }
  }
};

TEST_F(PushTest, A14_a_fist_pushes_what_it_meets_and_is_one_step_to_undo) {
  make_plate("plate", {0, 0, 0.1});
  const model::DualPtr before = model_.document().find_dual("plate");
  const std::size_t steps = model_.history().undo_steps();
  const std::string hash_before = hash();
  push_down(20);
  EXPECT_TRUE(model_.has_provisional());
  EXPECT_EQ(hash(), hash_before) << "a gesture in the air must not touch the document";
  EXPECT_GT(largest_move(*before, *preview("plate")), 0.004) << "but it is shown";
  EXPECT_EQ(interaction_.activity(0).tool, "pushing");
  EXPECT_EQ(interaction_.activity(0).entity, "plate");
  ASSERT_TRUE(interaction_.activity(0).disk.has_value());
  EXPECT_NEAR(interaction_.activity(0).disk->radius_m, 0.005 + 0.2 * 0.055, 1e-12) << "A13";
  rest();
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
  EXPECT_GT(largest_move(*before, shape("plate")), 0.004);
  EXPECT_EQ(interaction_.statistics().gestures_committed, 1U);
  EXPECT_TRUE(problems_.empty());
  touch(PaletteCommand::undo);
  EXPECT_EQ(hash(), hash_before);
}

TEST_F(PushTest, A17_the_falloff_chosen_on_the_palette_is_that_of_pushes) {
  make_plate("plate", {0, 0, 0.1});
  const auto pushed_falloff = [&] {
    push_down(20, 0.6);
    const FrameOutcome outcome = rest();
    EXPECT_EQ(outcome.submitted.size(), 1U);
    return outcome.submitted.at(0).effective.push_points().falloff();
  };
  EXPECT_EQ(pushed_falloff(), v1::FALLOFF_LITERAL) << "the paper's own is the default";
  const std::string literal = hash();
  touch(PaletteCommand::undo);
  touch(PaletteCommand::falloff);
  EXPECT_EQ(pushed_falloff(), v1::FALLOFF_SMOOTH);
  EXPECT_NE(hash(), literal) << "where several contacts' ranges meet, the points go elsewhere";
  touch(PaletteCommand::undo);
  touch(PaletteCommand::falloff);
  EXPECT_EQ(pushed_falloff(), v1::FALLOFF_LITERAL);
}

TEST_F(PushTest, A14_the_disk_pushes_from_either_side_and_never_pulls) {
  make_plate("plate", {0, 0, 0.1});
  const model::DualPtr before = model_.document().find_dual("plate");
  for (int i = 0; i <= 20; ++i) send(script_.closed({0, 0, 0.04 + 0.065 * i / 20.0}, 0.2, 0.0));
  rest();
  for (std::size_t i = 0; i < before->points.size(); ++i) {
    EXPECT_GE(shape("plate").points[i].z, before->points[i].z - 1e-12) << "pushed up from below";
  }
  EXPECT_GT(largest_move(*before, shape("plate")), 0.002);
  const model::DualPtr after = model_.document().find_dual("plate");
  // Away from the plate again, having begun on it: nothing sticks to the disk.
  for (int i = 0; i <= 20; ++i) send(script_.closed({0, 0, 0.13 + 0.003 * i}, 0.2, 0.0));
  rest();
  EXPECT_EQ(largest_move(*after, shape("plate")), 0.0);
}

TEST_F(PushTest, A14_a_hand_that_jumps_over_the_shape_in_one_frame_still_pushes) {
  make_plate("plate", {0, 0, 0.1});
  const model::DualPtr before = model_.document().find_dual("plate");
  send(script_.closed({0, 0, 0.30}, 0.5, 0.0));
  send(script_.closed({0, 0, 0.05}, 0.5, 0.0));  // seven radii at once
  rest();
  EXPECT_GT(largest_move(*before, shape("plate")), 0.04);
}

TEST_F(PushTest, A16_the_potentiometer_sets_the_range_live) {
  make_plate("plate", {0, 0, 0.1});
  const auto moved = [&] {
    std::size_t count = 0;
    const model::DualPtr now = preview("plate");
    for (std::size_t i = 0; i < now->points.size(); ++i) {
      if ((now->points[i].position() - shape("plate").points[i].position()).norm() > 1e-9) ++count;
    }
    return count;
  };
  push_down(10, 0.0);
  const std::size_t alone = moved();
  send(script_.closed({0, 0, 0.095}, 0.2, 0.8));  // the same place, the potentiometer turned
  const std::size_t together = moved();
  EXPECT_GT(alone, 0U);
  EXPECT_GT(together, 2 * alone);
  send(script_.closed({0, 0, 0.095}, 0.2, 0.0));
  EXPECT_EQ(moved(), alone) << "and back";
}

TEST_F(PushTest, a_lost_hand_takes_its_push_back_without_a_trace) {
  make_plate("plate", {0, 0, 0.1});
  const std::string before = hash();
  const std::uint64_t sequence = model_.sequence();
  push_down(10);
  for (int i = 0; i < 5; ++i) send(script_.empty());
  EXPECT_TRUE(model_.has_provisional()) << "within the grace period";
  for (int i = 0; i < 5; ++i) send(script_.empty());
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(hash(), before);
  EXPECT_EQ(model_.sequence(), sequence);
  EXPECT_EQ(interaction_.statistics().gestures_cancelled, 1U);
  ASSERT_EQ(problems_.size(), 1U);
  EXPECT_THAT(problems_[0], HasSubstr("push on \"plate\" cancelled"));
}

TEST_F(PushTest, a_fist_far_from_every_shape_does_nothing_at_all) {
  make_plate("plate", {0, 0, 0.1});
  const std::uint64_t sequence = model_.sequence();
  for (int i = 0; i <= 20; ++i) send(script_.closed({0.01 * i, 0.0, 0.3}));
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_TRUE(interaction_.targets().empty());
  rest();
  EXPECT_EQ(model_.sequence(), sequence);
  EXPECT_TRUE(problems_.empty());
}

TEST_F(PushTest, a_push_that_meets_no_point_is_no_step_of_history) {
  make_plate("plate", {0, 0, 0.1});
  const std::size_t steps = model_.history().undo_steps();
  const std::string before = hash();
  for (int i = 0; i <= 10; ++i) send(script_.closed({0.001 * i, 0.0, 0.13}, 0.2, 0.0));
  EXPECT_EQ(interaction_.targets(), std::vector<std::string>{"plate"});
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps);
  EXPECT_EQ(hash(), before);
}

TEST_F(PushTest, the_nearest_shape_is_pushed_unless_another_is_selected) {
  make_plate("left", {-0.2, 0, 0.1});
  make_plate("right", {0.2, 0, 0.1});
  const model::DualPtr left = model_.document().find_dual("left");
  push_down(10, 0.0, 0.2);
  rest();
  EXPECT_EQ(model_.document().find_dual("left"), left);
  const model::DualPtr right = model_.document().find_dual("right");
  interaction_.select("left");
  push_down(10, 0.0, 0.19);
  rest();
  EXPECT_EQ(model_.document().find_dual("right"), right) << "not selected, so not touched";
  push_down(10, 0.0, -0.2);
  rest();
  EXPECT_GT(largest_move(*left, shape("left")), 0.003);
}

TEST_F(PushTest, A9_the_surface_follows_a_push_while_points_and_surface_are_shown) {
  make_plate("plate", {0, 0, 0.1});
  push_down(10, 0.5);
  const model::DualPtr now = preview("plate");
  EXPECT_FALSE(now->stale);
  EXPECT_NE(now->fit->surface, shape("plate").fit->surface);
  rest();
  EXPECT_FALSE(shape("plate").stale);
  v1::Operation points;  // shown as points alone it goes stale instead
  points.mutable_set_representation()->set_entity("plate");
  points.mutable_set_representation()->set_representation(v1::REPRESENTATION_POINTS);
  ASSERT_TRUE(model_.submit(points).ok());
  push_down(10, 0.5, 0.02);
  rest();
  EXPECT_TRUE(shape("plate").stale);
}

TEST_F(PushTest, somebody_elses_operation_does_not_break_the_push) {
  make_plate("plate", {0, 0, 0.1});
  push_down(10);
  v1::Operation rename;
  rename.mutable_rename()->set_entity("plate");
  rename.mutable_rename()->set_name("Theirs");
  ASSERT_TRUE(model_.submit(rename).ok());
  const model::DualPtr before = model_.document().find_dual("plate");
  send(script_.closed({0, 0, 0.09}, 0.2, 0.0));
  rest();
  EXPECT_EQ(shape("plate").name, "Theirs");
  EXPECT_GT(largest_move(*before, shape("plate")), 0.004);
}

TEST_F(PushTest, a_push_whose_shape_was_deleted_tells_so_once) {
  make_plate("plate", {0, 0, 0.1});
  push_down(10);
  v1::Operation remove;
  remove.mutable_delete_()->set_entity("plate");
  ASSERT_TRUE(model_.submit(remove).ok());
  for (int i = 0; i < 5; ++i) send(script_.closed({0, 0, 0.09 - 0.001 * i}, 0.2, 0.0));
  EXPECT_EQ(problems_.size(), 1U);
  EXPECT_THAT(interaction_.activity(0).tool, HasSubstr("push: refused"));
  rest();
  EXPECT_EQ(problems_.size(), 1U);
  EXPECT_TRUE(model_.document().entities.empty());
}

TEST_F(PushTest, A13_hidden_fingers_do_not_shift_the_disk) {
  make_plate("plate", {0, 0, 0.1});
  const model::DualPtr before = model_.document().find_dual("plate");
  const auto fist = [&](double z) { return script_.closed({0, 0, z}, 0.2, 0.0); };
  send(fist(0.14));
  send(fist(0.135));
  for (int i = 0; i < 15; ++i) {  // half a second with two fingers only, 30 mm above the plate
    send(test::without_finger(test::without_finger(test::without_finger(fist(0.13), 0), 4), 2));
  }
  EXPECT_EQ(largest_move(*before, *preview("plate")), 0.0);
  ASSERT_TRUE(interaction_.activity(0).disk);
  EXPECT_NEAR((interaction_.activity(0).disk->centre - Vector3d(0, 0, 0.13)).norm(), 0.0, 1e-12);
}

}  // namespace
}  // namespace handloft::interaction
