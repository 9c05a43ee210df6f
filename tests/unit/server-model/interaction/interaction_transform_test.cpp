// With "Move" on, a closed or pointing hand takes a whole shape along (A28).

#include "server-model/interaction/hand_turn.h"
#include "tests/unit/server-model/interaction/interaction_fixture.h"

namespace handloft::interaction {
namespace {

class TransformTest : public GestureTest {
 protected:
  void SetUp() override {
    make_plate("plate", {0, 0, 0.1});
    touch(PaletteCommand::move);
    ASSERT_EQ(interaction_.modes().tool, HandTool::move);
    before_ = model_.document().find_dual("plate");
    hash_before_ = hash();
  }
  Vector3d moved(std::size_t i) {
    return shape("plate").points[i].position() - before_->points[i].position();
  }

  model::DualPtr before_;
  std::string hash_before_;
};

TEST_F(TransformTest, a_fist_takes_the_nearest_shape_along) {
  const Vector3d grip(0.0, 0.0, 0.12);
  const Vector3d way(0.05, -0.03, 0.08);
  const std::size_t steps = model_.history().undo_steps();
  for (int i = 0; i <= 10; ++i) send(script_.closed(grip + way * i / 10.0));
  EXPECT_EQ(hash(), hash_before_);
  EXPECT_NEAR((preview("plate")->points[7].position() - before_->points[7].position() - way).norm(), 0,
              1e-12);
  EXPECT_EQ(interaction_.activity(0).tool, "moving");
  rest();
  EXPECT_EQ(model_.history().undo_steps(), steps + 1);
  for (std::size_t i = 0; i < before_->points.size(); ++i) EXPECT_NEAR((moved(i) - way).norm(), 0, 1e-12);
  EXPECT_FALSE(shape("plate").stale) << "the surface comes along, so nothing needs a fit";
}

TEST_F(TransformTest, the_shape_turns_as_the_fist_turns) {
  const Vector3d grip(0.01, 0.0, 0.12);
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.5, Vector3d(1, 2, 3).normalized()));
  send(script_.closed(grip));
  send(test::turned(script_.closed(grip), turn));
  rest();
  for (std::size_t i = 0; i < before_->points.size(); ++i) {
    const Vector3d wanted = grip + turn * (before_->points[i].position() - grip);
    EXPECT_NEAR((shape("plate").points[i].position() - wanted).norm(), 0, 1e-12);
  }
}

TEST_F(TransformTest, the_potentiometer_scales_once_it_is_really_turned) {
  const Vector3d grip(0.0, 0.0, 0.12);
  send(script_.closed(grip, 0.5, 0.40));
  send(script_.closed(grip, 0.5, 0.42));  // its noise
  EXPECT_LT(largest_move(*before_, *preview("plate")), 1e-15);
  send(script_.closed(grip, 0.5, 0.40 + 0.03 + 0.5));  // half a turn of two octaves
  rest();
  for (std::size_t i = 0; i < before_->points.size(); ++i) {
    const Vector3d wanted = grip + 2.0 * (before_->points[i].position() - grip);
    EXPECT_NEAR((shape("plate").points[i].position() - wanted).norm(), 0, 1e-9);
  }
}

// As an icon that is dragged: D19.
TEST_F(TransformTest, fingers_that_fold_and_unfold_move_nothing) {
  const Vector3d grip(0.0, 0.0, 0.12), way(0.0, 0.02, 0.03);
  double frames = 0.5;
  for (const double times : {1.2, 1.1, 1.05, 1.0})
    send(test::since(test::opened(script_.closed(grip), times), frames++));
  for (int i = 0; i < 6; ++i) send(test::since(script_.closed(grip + way), frames++));
  for (const double times : {1.05, 1.1, 1.2})
    send(test::since(test::opened(script_.closed(grip + way), times), frames++));
  const Vector3d seen = preview("plate")->points[0].position() - before_->points[0].position();
  EXPECT_GT((seen - way).norm(), 3e-3) << "negative control: the fingertips' mean moves";
  send(test::since(script_.resting(grip + way), 0.5));
  for (std::size_t i = 0; i < before_->points.size(); ++i) EXPECT_NEAR((moved(i) - way).norm(), 0, 1e-12);
}

TEST_F(TransformTest, a_fingertip_moves_without_turning) {
  send(script_.pointing({0, 0, 0.11}, false));
  send(test::turned(script_.pointing({0, 0, 0.11}, false), Eigen::Matrix3d::Identity()));
  send(script_.pointing({0.02, 0.03, 0.11}, false));
  rest();
  for (std::size_t i = 0; i < before_->points.size(); ++i) {
    EXPECT_NEAR((moved(i) - Vector3d(0.02, 0.03, 0)).norm(), 0, 1e-12);
  }
}

TEST_F(TransformTest, a_lost_hand_puts_it_back_and_a_far_hand_takes_nothing) {
  for (int i = 0; i <= 10; ++i) send(script_.closed({0.01 * i, 0, 0.12}));
  for (int i = 0; i < 10; ++i) send(script_.empty());
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(hash(), hash_before_);
  for (int i = 0; i <= 10; ++i) send(script_.closed({0.01 * i, 0, 0.4}));
  rest();
  EXPECT_EQ(hash(), hash_before_);
}

TEST_F(TransformTest, the_selected_shape_comes_from_wherever_it_is) {
  interaction_.select("plate");
  send(script_.closed({0.3, 0, 0.4}));
  send(script_.closed({0.3, 0, 0.45}));
  rest();
  EXPECT_NEAR((moved(0) - Vector3d(0, 0, 0.05)).norm(), 0, 1e-12);
}

TEST_F(TransformTest, the_other_hand_may_push_meanwhile) {
  make_plate("other", {0.3, 0, 0.1});
  const model::DualPtr other = model_.document().find_dual("other");
  send(script_.closed({0, 0, 0.12}));
  touch(PaletteCommand::move);  // ends the first hand's hold; sculpt
  EXPECT_EQ(interaction_.modes().tool, HandTool::sculpt);
  touch(PaletteCommand::move);
  // Both hold: each its own shape, two operations.
  const std::size_t steps = model_.history().undo_steps();
  send(test::with_second_hand(script_.closed({0, 0, 0.12}), script_.closed({0.3, 0, 0.12})));
  send(test::with_second_hand(script_.closed({0, 0, 0.13}), script_.closed({0.3, 0, 0.14})));
  send(test::with_second_hand(script_.resting(), script_.resting()));
  EXPECT_EQ(model_.history().undo_steps(), steps + 2);
  EXPECT_NEAR((moved(0) - Vector3d(0, 0, 0.01)).norm(), 0, 1e-12);
  EXPECT_NEAR(
      (shape("other").points[0].position() - other->points[0].position() - Vector3d(0, 0, 0.02)).norm(), 0,
      1e-12);
}

TEST(HandTurnTest, finds_the_rotation_of_any_three_fingers_and_no_more) {
  FingertipPositions then;
  FingertipPositions now;
  const auto tips = HandScript::fingertips({0.1, 0.2, 0.3});
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.2, Vector3d(0.3, -1, 0.2).normalized()));
  for (std::size_t i = 0; i < tips.size(); ++i) {
    then[i] = tips[i];
    now[i] = turn * tips[i] + Vector3d(0.5, 0.1, -0.2);
  }
  for (const std::size_t hidden : {0U, 1U, 4U}) {
    FingertipPositions fewer = now;
    fewer[hidden].reset();
    const auto found = hand_turn(then, fewer);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT(found->angularDistance(turn), 1e-7);
  }
  FingertipPositions two = now;
  two[0].reset();
  two[1].reset();
  two[2].reset();
  EXPECT_FALSE(hand_turn(then, two));
  for (std::size_t i = 0; i < tips.size(); ++i) then[i] = Vector3d(0.01 * static_cast<double>(i), 0, 0);
  EXPECT_FALSE(hand_turn(then, then)) << "fingertips on a line tell no turn about it";
}

}  // namespace
}  // namespace handloft::interaction
