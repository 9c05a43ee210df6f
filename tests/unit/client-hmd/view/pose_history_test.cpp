#include "client-hmd/view/pose_history.h"

#include <gtest/gtest.h>

#include <limits>

namespace handloft::client {
namespace {

using std::chrono::milliseconds;

MeasuredPose sample(int ms, double x, double angle_rad = 0.0) {
  MeasuredPose out;
  out.time = from_ns(1'000'000'000) + milliseconds(ms);
  out.pose.position = {x, 0.0, 0.0};
  out.pose.orientation = glm::angleAxis(angle_rad, glm::dvec3(0, 0, 1));
  out.linear_velocity = {1.0, 0.0, 0.0};
  return out;
}
TimePoint at(int ms) {
  return from_ns(1'000'000'000) + milliseconds(ms);
}

TEST(PoseHistory, IsExactOnASampleAndInterpolatesBetweenTwo_V1) {
  PoseHistory history;
  ASSERT_TRUE(history.push(sample(0, 0.0, 0.0)));
  ASSERT_TRUE(history.push(sample(40, 0.4, 0.2)));
  const auto exact = history.at(at(40));
  ASSERT_TRUE(exact);
  EXPECT_EQ(exact->kind, PoseKind::exact);
  EXPECT_DOUBLE_EQ(exact->pose.position.x, 0.4);
  const auto between = history.at(at(10));
  ASSERT_TRUE(between);
  EXPECT_EQ(between->kind, PoseKind::interpolated);
  EXPECT_NEAR(between->pose.position.x, 0.1, 1e-12);
  EXPECT_NEAR(glm::angle(between->pose.orientation), 0.05, 1e-12);
}

TEST(PoseHistory, PredictsWithTheDaemonsFormula_T8) {
  PoseHistory history;
  ASSERT_TRUE(history.push(sample(0, 0.0)));
  const auto ahead = history.at(at(30));
  ASSERT_TRUE(ahead);
  EXPECT_EQ(ahead->kind, PoseKind::predicted);
  EXPECT_DOUBLE_EQ(ahead->pose.position.x, motion_time(0.030));
  EXPECT_LT(ahead->pose.position.x, 0.030) << "damped";
  EXPECT_FALSE(history.at(at(251))) << "lost by then";
}

TEST(PoseHistory, SaysNothingOfThePastOrOfGaps) {
  PoseHistory history;
  EXPECT_FALSE(history.at(at(0)));
  ASSERT_TRUE(history.push(sample(0, 0.0)));
  ASSERT_TRUE(history.push(sample(200, 1.0)));
  EXPECT_FALSE(history.at(at(-1)));
  EXPECT_FALSE(history.at(at(100))) << "a gap of 200 ms is not bridged";
}

TEST(PoseHistory, RefusesOldTimesNanAndWhatIsNoRotation) {
  PoseHistory history;
  ASSERT_TRUE(history.push(sample(100, 0.0)));
  EXPECT_FALSE(history.push(sample(100, 1.0)));
  EXPECT_FALSE(history.push(sample(50, 1.0)));
  EXPECT_FALSE(history.push(sample(110, std::numeric_limits<double>::quiet_NaN())));
  MeasuredPose none = sample(110, 0.0);
  none.pose.orientation = glm::dquat(0, 0, 0, 0);
  EXPECT_FALSE(history.push(none));
  EXPECT_TRUE(history.push(sample(110, 0.5)));
}

TEST(PoseHistory, StartsAnewWhenTheSourceDoes) {
  PoseHistory history;
  ASSERT_TRUE(history.push(sample(5000, 3.0)));
  ASSERT_TRUE(history.push(sample(0, 0.0)));
  EXPECT_FALSE(history.at(at(5000)));
  EXPECT_TRUE(history.at(at(0)));
}

TEST(PoseHistory, ForgetsTheOldest) {
  PoseHistoryOptions options;
  options.capacity = 8;
  PoseHistory history(options);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(history.push(sample(10 * i, i)));
  EXPECT_FALSE(history.at(at(0)));
  EXPECT_TRUE(history.at(at(150)));
}

}  // namespace
}  // namespace handloft::client
