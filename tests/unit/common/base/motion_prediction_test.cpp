// The one prediction formula (T8): speed v * exp(-s / tau) * e(s).

#include "common/base/motion_prediction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace handloft {
namespace {

// Simpson's rule over the speed, in pieces that end where the formula changes.
double integrate(double from, double to, const PredictionLimits& limits) {
  constexpr int steps = 200;
  const double h = (to - from) / steps;
  double sum = remaining_speed(from, limits) + remaining_speed(to, limits);
  for (int i = 1; i < steps; ++i) sum += (i % 2 == 1 ? 4 : 2) * remaining_speed(from + i * h, limits);
  return sum * h / 3;
}

TEST(MotionPrediction, HandValueWithinTheHorizonT8) {
  // 0.4 (1 - e^(-0.05/0.4)) = 0.4 * 0.117503... = 0.0470012
  EXPECT_NEAR(motion_time(0.05), 0.0470012, 1e-7);
}

TEST(MotionPrediction, TheWayIsTheIntegralOfTheSpeed) {
  const PredictionLimits limits;
  EXPECT_NEAR(motion_time(0.03, limits), integrate(0, 0.03, limits), 1e-10);
  EXPECT_NEAR(motion_time(0.1, limits), integrate(0, 0.06, limits) + integrate(0.06, 0.1, limits), 1e-10);
}

TEST(MotionPrediction, HoldsBeyondHorizonAndEase) {
  const PredictionLimits limits;
  const double end = limits.horizon_s + limits.ease_s;
  EXPECT_DOUBLE_EQ(motion_time(end, limits), motion_time(1000.0, limits));
  EXPECT_EQ(remaining_speed(end + 1e-9, limits), 0.0);
}

TEST(MotionPrediction, ThePastAndNaNMoveNothing) {
  EXPECT_EQ(motion_time(-1.0), 0.0);
  EXPECT_EQ(motion_time(std::numeric_limits<double>::quiet_NaN()), 0.0);
}

TEST(MotionPrediction, OrientationTurnsAboutTheWorldAxis) {
  const Eigen::Quaterniond start(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond later = predict_orientation(start, {0, 0, 2.0}, 0.05);
  const Eigen::AngleAxisd turn(later * start.inverse());
  EXPECT_NEAR(turn.angle(), 2.0 * motion_time(0.05), 1e-12);
  EXPECT_NEAR(turn.axis().z(), 1.0, 1e-12);
}

}  // namespace
}  // namespace handloft
