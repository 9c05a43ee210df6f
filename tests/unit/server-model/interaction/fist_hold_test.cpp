// Where a fist has gone and turned since it took hold (A28; D19, step 4).

#include "server-model/interaction/fist_hold.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/hand_script.h"

namespace handloft::interaction {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using std::chrono::milliseconds;

class FistHoldTest : public ::testing::Test {
 protected:
  /// A frame of a fist at `centre`, `ms` after the glove's first edge.
  FistWay at(int ms, const Vector3d& centre, const Quaterniond& turn = Quaterniond::Identity()) {
    HandFrame frame;
    frame.sample.capture_time = edge + milliseconds(ms);
    frame.sample.gesture = v1::GESTURE_CLOSED;
    frame.sample.gesture_since = edge;
    const auto tips = test::HandScript::fingertips(Vector3d::Zero());
    for (std::size_t i = 0; i < finger_count; ++i)
      frame.sample.fingertips[i] = Fingertip{centre + turn * tips[i], true};
    frame.centre = frame.fist_centre = centre;
    return fist.on_frame(frame);
  }
  const TimePoint edge = from_ns(5'000'000'000);
  FistHold fist;
};

TEST_F(FistHoldTest, the_way_begins_where_the_fist_has_folded) {
  EXPECT_EQ(at(20, {0, 0, 0}).translation, Vector3d::Zero());
  EXPECT_EQ(at(80, {0.004, 0, 0}).translation, Vector3d::Zero());
  EXPECT_EQ(at(100, {0.005, 0, 0}).translation, Vector3d::Zero());
  EXPECT_LT((at(120, {0.025, 0, 0.01}).translation - Vector3d(0.02, 0, 0.01)).norm(), 1e-15);
  EXPECT_EQ(fist.grasped_at(), Vector3d(0.005, 0, 0));
}

TEST_F(FistHoldTest, a_trembling_hand_takes_hold_and_lets_go_at_its_mean) {
  const auto tremor = [](int ms) { return Vector3d(0.0005 * std::cos(2 * M_PI * ms / 100.0), 0, 0); };
  for (int ms = 100; ms < 200; ms += 10) at(ms, tremor(ms));
  EXPECT_LT(fist.grasped_at().norm(), 1e-12);
  EXPECT_LT((at(230, {0.02, 0, 0}).translation - Vector3d(0.02, 0, 0)).norm(), 1e-12)
      << "from now on it stays";
  at(240, {0.02, 0, 0});
  for (int ms = 300; ms <= 500; ms += 10) at(ms, Vector3d(0.04, 0, 0) + tremor(ms));
  const auto way = fist.at_release(edge + milliseconds(600));
  ASSERT_TRUE(way);
  // Twelve frames and one of a period of ten: hardly a tenth of the tremor is left.
  EXPECT_LT((way->translation - Vector3d(0.04, 0, 0)).norm(), 0.2e-3);
}

TEST_F(FistHoldTest, a_moving_hand_lets_go_where_it_was_as_it_began_to_unfold) {
  for (int ms = 100; ms <= 500; ms += 10) at(ms, {0.0002 * (ms - 100), 0, 0});
  const auto way = fist.at_release(edge + milliseconds(450));  // it unfolds from 330 on
  ASSERT_TRUE(way);
  EXPECT_EQ(way->time, edge + milliseconds(330));
  EXPECT_NEAR(way->translation.x(), 0.0002 * 230, 1.01e-3);
  EXPECT_LT(fist.at_release(std::nullopt)->translation.x() - 0.0002 * 400, 1e-12) << "the last one as it was";
}

TEST_F(FistHoldTest, a_hand_that_opens_before_it_has_folded_has_gone_nowhere) {
  EXPECT_FALSE(fist.at_release(std::nullopt));
  at(20, {0, 0, 0});
  at(100, {0.01, 0, 0});
  at(150, {0.02, 0, 0});
  EXPECT_FALSE(fist.at_release(edge + milliseconds(160)));
  EXPECT_FALSE(fist.at_release(TimePoint{}));
  EXPECT_TRUE(fist.at_release(edge + milliseconds(230)));
}

TEST_F(FistHoldTest, turns_that_are_not_meant_are_not_told_and_others_whole) {
  const Vector3d axis = Vector3d(1, -2, 0.5).normalized();
  at(100, {0, 0, 0});
  const Quaterniond slight(AngleAxisd(0.04, axis)), whole(AngleAxisd(0.35, axis));
  at(110, {0, 0, 0}, whole);  // From here on it is not steady.
  EXPECT_EQ(at(120, {0, 0, 0}, slight).turn.angularDistance(Quaterniond::Identity()), 0);
  EXPECT_LT(at(130, {0, 0, 0}, whole).turn.angularDistance(whole), 1e-7);
  EXPECT_LT(fist.at_release(edge + milliseconds(260))->turn.angularDistance(whole), 1e-7);
}

TEST(MeantTurn, goes_from_nothing_to_the_whole_without_a_step) {
  constexpr double slack = 0.05, step = 1e-3;
  double before = 0;
  for (double angle = 0; angle < M_PI; angle += step) {
    const double meant =
        AngleAxisd(meant_turn(Quaterniond(AngleAxisd(angle, Vector3d::UnitX())), slack)).angle();
    EXPECT_GE(meant, before - 1e-9);
    EXPECT_LE(meant, before + 2.001 * step);
    EXPECT_LE(meant, angle + 1e-9);
    if (angle >= 2 * slack) {
      EXPECT_NEAR(meant, angle, 1e-9);
    }
    before = meant;
  }
  EXPECT_NEAR(before, M_PI, 2 * step);
}

}  // namespace
}  // namespace handloft::interaction
