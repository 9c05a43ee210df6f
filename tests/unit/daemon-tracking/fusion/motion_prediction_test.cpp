#include "common/base/motion_prediction.h"

#include <gtest/gtest.h>

#include <limits>

namespace handloft {
namespace {

TEST(MotionPrediction, MotionTimeIsTheIntegralOfTheRemainingSpeedT8) {
  double integral = 0.0;
  constexpr double step = 1e-5;
  for (double t = 0; t < 0.2; t += step) {
    EXPECT_NEAR(motion_time(t), integral, 1e-5);
    integral += remaining_speed(t + 0.5 * step) * step;
  }
}

TEST(MotionPrediction, HoldsAfterHorizonAndEase) {
  const PredictionLimits limits;
  const double end = limits.horizon_s + limits.ease_s;
  EXPECT_DOUBLE_EQ(motion_time(end), motion_time(100.0));
  EXPECT_EQ(remaining_speed(end + 1e-9), 0.0);
  EXPECT_LT(motion_time(100.0), limits.horizon_s + 0.5 * limits.ease_s);
  EXPECT_EQ(motion_time(-1.0), 0.0);
  EXPECT_EQ(motion_time(std::numeric_limits<double>::quiet_NaN()), 0.0);
}

TEST(MotionPrediction, TurnsAboutTheWorldsAxis) {
  const Eigen::Quaterniond start(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond ahead = predict_orientation(start, {0, 0, 2.0}, 0.05);
  const Eigen::AngleAxisd turn(ahead * start.conjugate());
  EXPECT_NEAR(turn.angle(), 2.0 * motion_time(0.05), 1e-12);
  EXPECT_TRUE(turn.axis().isApprox(Eigen::Vector3d::UnitZ(), 1e-9));
  EXPECT_TRUE(predict_orientation(start, {0, 0, 0}, 0.05).isApprox(start));
}

}  // namespace
}  // namespace handloft
