// The 3D mouse drives the selected icon by rates (D19, step 4).

#include <limits>

#include "server-model/interaction/space_mouse.h"
#include "tests/unit/server-model/interaction/sculpt_fixture.h"

namespace handloft::interaction {
namespace {

class SpaceMouseTest : public SculptTest {
 protected:
  void SetUp() override {
    SculptTest::SetUp();
    add_icon("p", {{0, 0, sheet_z}}, v1::ICON_POINT, v1::ICON_DRIVING, {"hand", "spacemouse"});
    pick();
    before_ = hash();
    steps_ = steps();
  }
  /// By a fist that comes and goes.
  void pick(const Vector3d& at = {0, 0, 0.11}) {
    send(script_.closed(at));
    rest();
  }
  FrameOutcome push(double time_s, const Vector3d& translation, const Vector3d& rotation = Vector3d::Zero()) {
    v1::TrackingFrame frame;
    frame.set_capture_time_ns(start_ns + static_cast<std::int64_t>(std::llround(1e9 * time_s)));
    set_vec3(*frame.mutable_space_mouse()->mutable_translation(), translation);
    set_vec3(*frame.mutable_space_mouse()->mutable_rotation(), rotation);
    return send(frame);
  }
  /// Up and back to rest within a second, then the pause; so many frames a second.
  void push_up(int rate, double begin_s) {
    for (int i = 0; i <= rate; ++i) {
      const double t = static_cast<double>(i) / rate;
      const double s = std::sin(M_PI * t);
      // Above the dead zone all the time but at its ends.
      push(begin_s + t, {0, 0, i == 0 || i == rate ? 0 : 0.05 + 0.5 * s * s});
    }
    for (int i = 1; i <= rate; ++i) push(begin_s + 1 + static_cast<double>(i) / rate, Vector3d::Zero());
  }
  static constexpr std::int64_t start_ns = 100'000'000'000;
  std::string before_;
  std::size_t steps_ = 0;
};

TEST_F(SpaceMouseTest, a_push_is_one_operation_that_ends_with_a_pause) {
  for (int i = 0; i <= 30; ++i) push(i / 30.0, {0, 0, 1});
  EXPECT_TRUE(marked("p", IconMark::Kind::held));
  EXPECT_GT(height(seen(), 0, 0), 0.04);
  EXPECT_EQ(hash(), before_);
  push(1 + 1 / 30.0, Vector3d::Zero());
  push(1.2, Vector3d::Zero());
  EXPECT_TRUE(model_.has_provisional()) << "a pause of 0.2 s";
  push(1.35, Vector3d::Zero());
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(steps(), steps_ + 1);
  // A second at 5 cm/s and half a frame at the end.
  EXPECT_NEAR(height(sheet(), 0, 0), 0.05 + 0.05 * 0.5 / 30, 1e-9);
  EXPECT_TRUE(no_marks());
  EXPECT_EQ(interaction_.statistics().gestures_committed, 1U);
}

TEST_F(SpaceMouseTest, the_way_does_not_hang_on_the_frame_rate) {
  std::vector<double> heights;
  for (const int rate : {30, 60, 240}) {
    push_up(rate, 10.0 * static_cast<double>(heights.size() + 1));
    heights.push_back(height(sheet(), 0, 0));
    ASSERT_GT(heights.back(), 0.005);
    ASSERT_EQ(steps(), steps_ + 1);
    v1::Operation undo;
    undo.mutable_undo();
    submit(undo);
    ASSERT_EQ(hash(), before_);
  }
  // 0.05 m/s times the mean of 0.5 sin^2 / 0.95.
  for (const double each : heights) EXPECT_NEAR(each, 0.05 * 0.25 / 0.95, 1e-7);
}

TEST_F(SpaceMouseTest, X2_the_same_frames_give_the_same_bits) {
  push_up(30, 1);
  const std::string once = hash();
  v1::Operation undo;
  undo.mutable_undo();
  submit(undo);
  push_up(30, 50);
  EXPECT_EQ(hash(), once);
}

TEST_F(SpaceMouseTest, turns_what_can_be_turned) {
  v1::Operation normal;
  normal.mutable_change_icon()->set_entity("sheet");
  normal.mutable_change_icon()->set_icon("p");
  normal.mutable_change_icon()->set_property(v1::ICON_NORMAL);
  submit(normal);
  push(0, Vector3d::Zero());
  for (int i = 1; i <= 15; ++i) push(i / 30.0, Vector3d::Zero(), {1, 0, 0});
  interaction_.finish();
  // Half a frame less at the beginning.
  const double angle = 0.8 * 14.5 / 30;
  const Vector3d wanted = Eigen::AngleAxisd(angle, Vector3d::UnitX()) * Vector3d::UnitZ();
  EXPECT_LT((sheet()->surface->normal(0.2, 0.15) - wanted).norm(), 1e-9);
}

TEST_F(SpaceMouseTest, D17_drives_only_what_lists_it_and_drives_at_all) {
  add_icon("hand", {{0.1, 0, sheet_z}}, v1::ICON_POINT, v1::ICON_DRIVING, {"hand"});
  add_icon("passive", {{-0.1, 0, sheet_z}}, v1::ICON_POINT, v1::ICON_PASSIVE, {"spacemouse"});
  for (const Vector3d& at : {Vector3d(0.1, 0, 0.11), Vector3d(-0.1, 0, 0.11)}) {
    pick(at);
    const std::string then = hash();
    push(100 * at.x() + 20, {0, 0, 1});
    push(100 * at.x() + 20.1, {0, 0, 1});
    EXPECT_FALSE(model_.has_provisional());
    EXPECT_EQ(hash(), then);
    interaction_.finish();
  }
}

TEST_F(SpaceMouseTest, rests_within_its_dead_zone) {
  for (int i = 0; i < 60; ++i) push(i / 30.0, {0.04, -0.04, 0.049}, {0.04, 0, 0});
  EXPECT_FALSE(model_.has_provisional());
  EXPECT_EQ(hash(), before_);
}

TEST_F(SpaceMouseTest, a_gap_in_tracking_makes_no_jump) {
  push(0, {0, 0, 1});
  push(0.03, {0, 0, 1});
  push(5.0, {0, 0, 1});
  interaction_.finish();
  EXPECT_NEAR(height(sheet(), 0, 0), 0.05 * 0.03, 1e-9) << "nobody saw the cap meanwhile";
}

TEST_F(SpaceMouseTest, a_frame_with_a_bad_number_is_ignored) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  push(0, {nan, 0, 0});
  push(0.1, Vector3d::Zero(), {0, std::numeric_limits<double>::infinity(), 0});
  EXPECT_EQ(interaction_.statistics().frames_ignored, 2U);
  ASSERT_EQ(problems_.size(), 2U);
  EXPECT_THAT(problems_[0], HasSubstr("space_mouse.translation.x"));
  EXPECT_THAT(problems_[1], HasSubstr("space_mouse.rotation.y"));
  // Beyond 1 counts as 1.
  push(1, {0, 0, 1e9});
  push(1.1, {0, 0, 1e9});
  interaction_.finish();
  EXPECT_NEAR(height(sheet(), 0, 0), 0.05 * 0.1, 1e-9);
}

TEST_F(SpaceMouseTest, what_a_hand_holds_the_mouse_leaves_alone) {
  send(script_.closed({0, 0, 0.12}));
  v1::TrackingFrame frame = script_.closed({0, 0, 0.13});
  frame.mutable_space_mouse()->mutable_translation()->set_x(1);
  send(frame);
  frame.set_capture_time_ns(script_.empty().capture_time_ns());
  send(frame);
  rest();
  EXPECT_EQ(steps(), steps_ + 1);
  EXPECT_LT((icon("p").translation - Vector3d(0, 0, 0.01)).norm(), 1e-12);
}

TEST_F(SpaceMouseTest, D20_stops_where_the_model_refuses_and_says_it_once) {
  add_icon("pin", {{0, 0, sheet_z}}, v1::ICON_POINT, v1::ICON_PASSIVE);
  const std::string then = hash();
  for (int i = 0; i <= 20; ++i) push(i / 30.0, {0, 0, 1});
  EXPECT_EQ(problems_.size(), 1U);
  interaction_.finish();
  EXPECT_EQ(hash(), then);
}

}  // namespace
}  // namespace handloft::interaction
