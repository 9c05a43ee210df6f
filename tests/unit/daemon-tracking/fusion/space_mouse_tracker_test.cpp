// T1: six axes as one sample, in world axes.

#include "daemon-tracking/fusion/space_mouse_tracker.h"

#include <gtest/gtest.h>

#include "daemon-tracking/source/space_mouse/space_mouse_streams.h"

namespace handloft::tracking {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint start = from_ns(7'000'000'000);

DeviceBytes report(int ms, std::uint8_t id, const std::vector<int>& axes) {
  DeviceBytes out{start + milliseconds(ms), DeviceData::space_mouse_report, {id}};
  for (const int axis : axes) {
    const auto bits = static_cast<std::uint16_t>(axis);
    out.bytes.push_back(static_cast<std::uint8_t>(bits & 0xFFu));
    out.bytes.push_back(static_cast<std::uint8_t>(bits >> 8));
  }
  return out;
}

FusedSpaceMouse mouse_of(const SpaceMouseTracker& tracker) {
  FusedSpaceMouse mouse;
  tracker.describe(mouse);
  return mouse;
}

TEST(SpaceMouseTracker, SplitReportsAreOneSample) {
  SpaceMouseTracker tracker;
  ASSERT_TRUE(tracker.consume(report(0, 1, {350, 0, 0})).ok());
  EXPECT_EQ(mouse_of(tracker).translation.x(), 0.0) << "not before its rotation";
  ASSERT_TRUE(tracker.consume(report(1, 2, {0, 0, 350})).ok());
  EXPECT_EQ(mouse_of(tracker).translation.x(), 1.0);
  EXPECT_EQ(mouse_of(tracker).rotation.z(), -1.0);
  EXPECT_EQ(mouse_of(tracker).time, start + milliseconds(1));
}

TEST(SpaceMouseTracker, CombinedReportsAreTheSameSample) {
  SpaceMouseTracker split, combined;
  ASSERT_TRUE(split.consume(report(0, 1, {100, -200, 300})).ok());
  ASSERT_TRUE(split.consume(report(0, 2, {-50, 60, -70})).ok());
  ASSERT_TRUE(combined.consume(report(0, 1, {100, -200, 300, -50, 60, -70})).ok());
  EXPECT_EQ(mouse_of(split).translation, mouse_of(combined).translation);
  EXPECT_EQ(mouse_of(split).rotation, mouse_of(combined).rotation);
}

TEST(SpaceMouseTracker, TheCapsAxesBecomeTheWorlds) {
  SpaceMouseTracker tracker;
  // Pushed to the right, pulled towards the designer, pressed down.
  ASSERT_TRUE(tracker.consume(report(0, 1, {350, 350, 350, 350, 350, 350})).ok());
  EXPECT_EQ(mouse_of(tracker).translation, Eigen::Vector3d(1, -1, -1));
  // Turning is about the same axes: clockwise from above is about z downwards.
  EXPECT_EQ(mouse_of(tracker).rotation, Eigen::Vector3d(1, -1, -1));
}

TEST(SpaceMouseTracker, HasADeadZoneAndClamps) {
  SpaceMouseTracker tracker;
  ASSERT_TRUE(tracker.consume(report(0, 1, {10, -10, 11, 32767, -32768, 0})).ok());
  const FusedSpaceMouse mouse = mouse_of(tracker);
  EXPECT_EQ(mouse.translation.x(), 0.0);
  EXPECT_EQ(mouse.translation.y(), 0.0);
  EXPECT_NEAR(mouse.translation.z(), -(11.0 / 350 - 0.03) / 0.97, 1e-12) << "begins at nothing";
  EXPECT_EQ(mouse.rotation.x(), 1.0);
  EXPECT_EQ(mouse.rotation.y(), 1.0);
}

TEST(SpaceMouseTracker, ATranslationThatStaysAloneIsTakenByTime) {
  SpaceMouseTracker tracker;
  ASSERT_TRUE(tracker.consume(report(0, 1, {175, 0, 0})).ok());
  tracker.advance(start + milliseconds(20));
  EXPECT_EQ(mouse_of(tracker).translation.x(), 0.0);
  tracker.advance(start + milliseconds(21));
  EXPECT_GT(mouse_of(tracker).translation.x(), 0.4);
  EXPECT_EQ(mouse_of(tracker).time, start);
}

TEST(SpaceMouseTracker, UnpluggedWhilePushedItIsAtRestT3) {
  SpaceMouseTracker tracker;
  ASSERT_TRUE(tracker.consume(report(0, 1, {350, 0, 0, 0, 0, 0})).ok());
  ASSERT_TRUE(tracker.consume({start, DeviceData::space_mouse_report, {3, 0x81, 0x02}}).ok());
  EXPECT_EQ(mouse_of(tracker).buttons, 0x281u);
  tracker.device_gone(start + milliseconds(5));
  EXPECT_FALSE(mouse_of(tracker).present);
  EXPECT_EQ(mouse_of(tracker).translation.norm(), 0.0);
  EXPECT_EQ(mouse_of(tracker).buttons, 0u);
}

TEST(SpaceMouseTracker, ABadReportChangesNothing) {
  SpaceMouseTracker tracker;
  ASSERT_TRUE(tracker.consume(report(0, 1, {350, 0, 0, 0, 0, 0})).ok());
  EXPECT_FALSE(tracker.consume({start, DeviceData::space_mouse_report, {}}).ok());
  EXPECT_FALSE(tracker.consume({start, DeviceData::space_mouse_report, {1, 2, 3}}).ok());
  EXPECT_EQ(mouse_of(tracker).translation.x(), 1.0);
}

TEST(SimulatedSpaceMouse, BothFormsTellTheSameMovement) {
  SpaceMouseTracker split, combined;
  auto first = simulated_space_mouse_stream({start, 12.0, SpaceMouseForm::split});
  auto second = simulated_space_mouse_stream({start, 12.0, SpaceMouseForm::combined});
  Eigen::Matrix<double, 6, 1> largest = Eigen::Matrix<double, 6, 1>::Zero();
  TimePoint until = start;
  auto a = first->next(), b = second->next();
  for (; until <= start + std::chrono::seconds(12); until += milliseconds(1)) {
    for (; a && delivery_time(*a) <= until; a = first->next())
      if (const auto* bytes = std::get_if<DeviceBytes>(&*a)) {
        ASSERT_TRUE(split.consume(*bytes).ok());
      }
    for (; b && delivery_time(*b) <= until; b = second->next())
      if (const auto* bytes = std::get_if<DeviceBytes>(&*b)) {
        ASSERT_TRUE(combined.consume(*bytes).ok());
      }
    ASSERT_EQ(mouse_of(split).translation, mouse_of(combined).translation);
    ASSERT_EQ(mouse_of(split).rotation, mouse_of(combined).rotation);
    largest.head<3>() = largest.head<3>().cwiseMax(mouse_of(split).translation.cwiseAbs());
    largest.tail<3>() = largest.tail<3>().cwiseMax(mouse_of(split).rotation.cwiseAbs());
  }
  EXPECT_GT(largest.minCoeff(), 0.99) << "every axis was moved";
}

}  // namespace
}  // namespace handloft::tracking
