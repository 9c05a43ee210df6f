#include "daemon-tracking/main/accuracy_meter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace handloft::tracking {
namespace {

Truth truth_at(std::int64_t ns) {
  Truth truth;
  truth.time = from_ns(ns);
  truth.hand_present = true;
  for (auto& tip : truth.fingertips_m) tip[2] = 0.1;
  return truth;
}

FusedState state_at(std::int64_t ns) {
  FusedState state;
  state.time = from_ns(ns);
  for (FusedTip& tip : state.hand.tips) {
    tip.state = TrackingState::tracked;
    tip.position_m = {0, 0, 0.1};
  }
  state.head.position_valid = state.head.orientation_valid = true;
  return state;
}

TEST(AccuracyMeter, RootMeanSquareAndLargestOfHandValues) {
  AccuracyMeter meter;
  meter.add(truth_at(5));
  FusedState state = state_at(5);
  state.hand.tips[1].position_m.x() += 0.003;
  state.hand.tips[2].position_m.y() -= 0.004;
  state.hand.tips[4].state = TrackingState::lost;
  state.head.position_m.x() = 0.002;
  state.head.orientation = Eigen::AngleAxisd(std::numbers::pi / 6, Eigen::Vector3d::UnitY());
  meter.add(state);
  const Accuracy& accuracy = meter.accuracy();
  EXPECT_EQ(accuracy.compared, 1u);
  EXPECT_EQ(accuracy.fingertips_lost, 1u);
  EXPECT_EQ(accuracy.fingertips_m.count, 4u);
  EXPECT_NEAR(accuracy.fingertips_m.rms(), 0.0025, 1e-12);  // sqrt((9 + 16) / 4) mm
  EXPECT_NEAR(accuracy.fingertips_m.largest, 0.004, 1e-12);
  EXPECT_NEAR(accuracy.by_finger_m[1].rms(), 0.003, 1e-12);
  EXPECT_EQ(accuracy.by_finger_m[4].count, 0u);
  EXPECT_EQ(accuracy.by_finger_m[4].rms(), 0.0) << "of nothing";
  EXPECT_NEAR(accuracy.head_position_m.rms(), 0.002, 1e-12);
  EXPECT_NEAR(accuracy.head_rotation_rad.rms(), std::numbers::pi / 6, 1e-9);
}

TEST(AccuracyMeter, ComparesOnlyTheSameInstant) {
  AccuracyMeter meter;
  meter.add(truth_at(5));
  meter.add(state_at(6));
  EXPECT_EQ(meter.accuracy().compared, 0u);
  for (std::int64_t ns = 10; ns < 1010; ++ns) meter.add(truth_at(ns));
  meter.add(state_at(5));
  EXPECT_EQ(meter.accuracy().compared, 0u) << "long forgotten: memory is bounded";
  meter.add(state_at(1009));
  EXPECT_EQ(meter.accuracy().compared, 1u);
}

TEST(AccuracyMeter, AHandThatIsNotThereIsNotMissed) {
  AccuracyMeter meter;
  Truth truth = truth_at(5);
  truth.hand_present = false;
  meter.add(truth);
  FusedState state = state_at(5);
  for (FusedTip& tip : state.hand.tips) tip.state = TrackingState::lost;
  state.head.orientation_valid = false;
  meter.add(state);
  EXPECT_EQ(meter.accuracy().fingertips_lost, 0u);
  EXPECT_EQ(meter.accuracy().heads_lost, 1u);
}

}  // namespace
}  // namespace handloft::tracking
