// When frames are begun, latched and seen (V1, V5), which monitor they go to, and how far they are turned:
// without graphics.

#include "client-hmd/view/frame_pacer.h"

#include <gmock/gmock.h>

#include "client-hmd/display/monitor_choice.h"
#include "client-hmd/mirror/photon_figures.h"
#include "client-hmd/view/late_turn.h"

namespace handloft::client {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr Duration period = milliseconds(10);

TimePoint at_ms(double ms) {
  return from_ns(1'000'000'000) + from_seconds(ms / 1e3);
}

/// Has seen swaps at 0, 10, 20 ms of frames that took 3 ms and 1 ms.
FramePacer paced() {
  FramePacer pacer;
  pacer.set_period(period);
  for (int i = 0; i < 3; ++i) {
    pacer.drew(milliseconds(3), milliseconds(1));
    pacer.swapped(pacer.plan(at_ms(10.0 * i - 8.0)), at_ms(10.0 * i));
  }
  return pacer;
}

TEST(FramePacer, BeginsAsLateAsTheNextRefreshAllows_V1) {
  const FramePlan plan = paced().plan(at_ms(21.0));
  EXPECT_EQ(plan.refresh, at_ms(30.0));
  EXPECT_EQ(plan.begin, at_ms(30.0 - 3.0 - 1.0 - 1.5));
  EXPECT_EQ(plan.latch, at_ms(30.0 - 1.0 - 1.5));
  EXPECT_EQ(plan.light, at_ms(35.0));
}

TEST(FramePacer, TakesTheRefreshAfterWhenTheNextCannotBeMade) {
  const FramePlan plan = paced().plan(at_ms(26.0));
  EXPECT_EQ(plan.refresh, at_ms(40.0));
  EXPECT_EQ(plan.begin, at_ms(34.5));
  // Long after: the refreshes go on in their rhythm.
  EXPECT_EQ(paced().plan(at_ms(1021.0)).refresh, at_ms(1030.0));
}

TEST(FramePacer, NeverPlansBeforeNowAndNeverWaitsWithoutARefresh_V5) {
  FramePacer none;
  none.set_unpaced_latency(milliseconds(16));
  const FramePlan plan = none.plan(at_ms(7.0));
  EXPECT_EQ(plan.begin, at_ms(7.0));
  EXPECT_EQ(plan.latch, at_ms(7.0));
  EXPECT_EQ(plan.light, at_ms(23.0));
  none.drew(milliseconds(70), milliseconds(5));
  EXPECT_EQ(none.plan(at_ms(7.0)).light, at_ms(82.0)) << "as the last frame took";
  FramePacer slow = paced();
  slow.drew(milliseconds(35), milliseconds(1));  // Longer than a period.
  for (double now = 20.0; now < 60.0; now += 0.7) {
    const FramePlan one = slow.plan(at_ms(now));
    EXPECT_GE(one.begin, at_ms(now));
    EXPECT_GE(one.latch, one.begin);
    EXPECT_GE(one.refresh, one.latch);
    EXPECT_LE(one.begin - at_ms(now), period) << "waits at most for a refresh";
  }
}

TEST(FramePacer, KeepsMoreFreeWhileItMissesRefreshes) {
  FramePacer pacer = paced();
  const FramePlan plan = pacer.plan(at_ms(21.0));
  EXPECT_TRUE(pacer.swapped(plan, at_ms(40.0)));
  EXPECT_EQ(pacer.missed(), 1U);
  EXPECT_EQ(pacer.margin(), microseconds(2250));
  double now = 40.0;
  for (int i = 0; i < 20; ++i, now += 20.0) pacer.swapped(pacer.plan(at_ms(now)), at_ms(now + 20.0));
  EXPECT_LE(pacer.margin(), period / 2) << "half a period is the most";
  const Duration most = pacer.margin();
  for (int i = 0; i < 1000; ++i, now += 10.0) pacer.swapped(pacer.plan(at_ms(now + 1.0)), at_ms(now + 10.0));
  EXPECT_LT(pacer.margin(), most);
  EXPECT_LT(pacer.margin() - microseconds(1500), microseconds(20)) << "and it forgets";
}

TEST(FramePacer, PassesOverNonsense) {
  FramePacer pacer = paced();
  pacer.drew(-milliseconds(5), milliseconds(1));
  pacer.drew(std::chrono::hours(1), milliseconds(1));
  EXPECT_EQ(pacer.plan(at_ms(21.0)).refresh, at_ms(30.0));
  pacer.set_period(Duration::zero());
  EXPECT_EQ(pacer.plan(at_ms(21.0)).begin, at_ms(21.0));
}

TEST(PhotonFigures, CountsFromExposureAndMeasurementToLight_V1) {
  PhotonFigures figures;
  for (int i = 0; i < 4; ++i) {
    FrameTimes times;
    times.exposure = at_ms(i / 2 * 20.0);  // Every picture twice.
    times.newest_pose = at_ms(10.0 * i + 20.0);
    times.swapped = at_ms(10.0 * i + 30.0);
    times.to_light = milliseconds(5);
    times.predicted_light = at_ms(10.0 * i + 33.0);
    times.missed_refresh = i == 3;
    figures.add(times);
  }
  EXPECT_EQ(figures.frames, 4U);
  EXPECT_EQ(figures.missed_refreshes, 1U);
  EXPECT_EQ(figures.repeated_films, 2U);
  EXPECT_NEAR(figures.motion_to_photon.quantile_ms(0.5), 15.0, 0.26);
  EXPECT_NEAR(figures.camera_to_photon.quantile_ms(1.0), 45.0, 0.26);
  EXPECT_NEAR(figures.prediction_error.quantile_ms(0.5), 2.0, 0.26);
  EXPECT_THAT(describe(figures, {}), HasSubstr("camera to light"));
  EXPECT_THAT(describe(PhotonFigures{}, {}), testing::Not(HasSubstr("camera to light")));
}

TEST(MonitorChoice, FallsBackToAWindowAndReturns_V4) {
  const MonitorInfo desk{"DP-1", 0, 0, 2560, 1440, 60};
  const MonitorInfo headset{"HDMI-1", 2560, 0, 2880, 1600, 90};
  MonitorChoice choice(std::string("1"));
  const std::optional<Placement> first = choice.after_change({desk, headset});
  ASSERT_TRUE(first && first->cover);
  EXPECT_EQ(*first->cover, headset);
  EXPECT_EQ(first->said, "");
  EXPECT_FALSE(choice.after_change({desk, headset})) << "nothing changed";
  const std::optional<Placement> gone = choice.after_change({desk});
  ASSERT_TRUE(gone);
  EXPECT_FALSE(gone->cover);
  EXPECT_THAT(gone->said, HasSubstr("HDMI-1 was unplugged"));
  EXPECT_FALSE(choice.after_change({desk}));
  EXPECT_FALSE(choice.after_change({})) << "not even a monitor left: still a window";
  // Back under another number: the name counts.
  const std::optional<Placement> back = choice.after_change({headset, desk});
  ASSERT_TRUE(back && back->cover);
  EXPECT_EQ(back->cover->name, "HDMI-1");
  EXPECT_THAT(back->said, HasSubstr("back"));
  // Another place or mode is another placement.
  MonitorInfo moved = headset;
  moved.x_px = 0;
  EXPECT_TRUE(choice.after_change({moved, desk}));
}

TEST(MonitorChoice, FindsByNameOrNumberAndSaysWhatIsMissing) {
  const std::vector<MonitorInfo> monitors{
      {"DP-1", 0, 0, 2560, 1440, 60}, {"DP-12", 2560, 0, 1920, 1080, 60}, {"VR", 0, 0, 0, 0, 90}};
  EXPECT_EQ(find_monitor(monitors, "DP-1")->name, "DP-1") << "the whole name beats a part";
  EXPECT_EQ(find_monitor(monitors, "12")->name, "DP-12") << "no such number, but a part of one name";
  EXPECT_EQ(find_monitor(monitors, "1")->name, "DP-12");
  EXPECT_FALSE(find_monitor(monitors, "DP")) << "two have it";
  EXPECT_FALSE(find_monitor(monitors, "2")) << "has no size";
  EXPECT_FALSE(find_monitor(monitors, ""));
  MonitorChoice nowhere(std::string("HDMI"));
  EXPECT_THAT(nowhere.after_change(monitors)->said, HasSubstr("no monitor 'HDMI'"));
  EXPECT_FALSE(MonitorChoice(std::nullopt).after_change(monitors)) << "windows stay where they are";
  EXPECT_THAT(describe(monitors), HasSubstr("1: DP-12, 1920x1080 at 60 Hz\n"));
}

TEST(LateTurn, IsCutToItsLimitAboutTheSameAxis_V1) {
  const glm::dvec3 axis = glm::normalize(glm::dvec3(0.2, -0.5, 0.9));
  RigidPose drawn{{0, 0, 0}, glm::angleAxis(0.8, glm::normalize(glm::dvec3(1, 1, 0)))};
  const LateTurnLimits limits;
  for (const double angle : {0.0, 0.01, 0.05, 0.3, 3.0}) {
    PoseAnswer shown{{{1, 2, 3}, glm::angleAxis(angle, axis) * drawn.orientation}, PoseKind::predicted};
    const glm::dquat turn = late_turn(drawn, shown, limits);
    EXPECT_NEAR(glm::angle(turn), std::min(angle, limits.largest_rad()), 1e-9);
    if (angle > 0.0) {
      EXPECT_NEAR(glm::dot(glm::axis(turn), axis), 1.0, 1e-9);
    }
    shown.pose.orientation = -shown.pose.orientation;  // The same rotation.
    EXPECT_NEAR(glm::angle(late_turn(drawn, shown, limits)), std::min(angle, limits.largest_rad()), 1e-9);
  }
  EXPECT_EQ(late_turn(drawn, std::nullopt), glm::dquat(1.0, 0.0, 0.0, 0.0));
}

TEST(LateTurn, MarginHoldsTheLargestTurnAboutAnyAxis_V1) {
  const Pinhole shown = centred_pinhole(640, 360, 0.8);
  const double turn_rad = LateTurnLimits{}.largest_rad();
  const int margin = margin_for_turn(shown, turn_rad);
  EXPECT_EQ(margin_for_turn(shown, 0.0), 0);
  EXPECT_LE(margin_for_turn(shown, 1.5), 180);
  double farthest = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double a = i * 0.37, b = std::acos(1.0 - 2.0 * (i + 0.5) / 200.0);
    const glm::dvec3 axis(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
    const glm::dmat3 warp = rotation_warp(shown, glm::dquat(1, 0, 0, 0), glm::angleAxis(turn_rad, axis));
    for (const double x : {-0.5, 639.5}) {
      for (const double y : {-0.5, 359.5}) {
        const glm::dvec3 source = warp * glm::dvec3(x, y, 1.0);
        const glm::dvec2 at = glm::dvec2(source) / source.z;
        farthest = std::max({farthest, -0.5 - at.x, at.x - 639.5, -0.5 - at.y, at.y - 359.5});
      }
    }
  }
  EXPECT_LE(farthest, margin);
  EXPECT_GT(farthest, 0.6 * margin) << "and no larger than it needs to be";
}

}  // namespace
}  // namespace handloft::client
