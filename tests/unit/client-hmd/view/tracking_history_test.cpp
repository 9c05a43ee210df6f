#include <gtest/gtest.h>

#include <limits>

#include "client-hmd/view/tracking_feed.h"

namespace handloft::client {
namespace {

using std::chrono::milliseconds;

v1::TrackingFrame frame(int ms) {
  v1::TrackingFrame out;
  out.set_capture_time_ns(to_ns(from_ns(1'000'000'000) + milliseconds(ms)));
  v1::HeadState& head = *out.mutable_head();
  head.set_state(v1::TRACKING_TRACKED);
  head.mutable_world_from_head()->mutable_position()->set_x(0.001 * ms);
  head.mutable_world_from_head()->mutable_orientation()->set_w(1.0);
  v1::HandState& hand = *out.add_hands();
  hand.set_pressure(0.4);
  for (int i = 0; i < 5; ++i) {
    hand.add_fingertip_states(i == 4 ? v1::TRACKING_PREDICTED : v1::TRACKING_TRACKED);
    for (const double coordinate : {0.0, 0.0, 0.01 * i + 0.0001 * ms})
      hand.add_fingertip_positions(coordinate);
  }
  v1::CameraState& camera = *out.add_cameras();
  camera.set_camera(2);
  camera.set_on_head(true);
  camera.set_state(v1::TRACKING_TRACKED);
  camera.set_width_px(640);
  camera.set_height_px(480);
  camera.set_fx_px(600);
  camera.set_fy_px(600);
  camera.mutable_world_from_camera()->mutable_orientation()->set_w(1.0);
  camera.mutable_world_from_camera()->mutable_position()->set_y(0.002 * ms);
  camera.set_exposure_time_ns(out.capture_time_ns() - 5'000'000);
  return out;
}
TimePoint at(int ms) {
  return from_ns(1'000'000'000) + milliseconds(ms);
}

TEST(TrackingHistory, AnswersForHeadCameraAndFingersAtAnExposure_V1) {
  TrackingHistory history;
  for (int ms = 0; ms <= 60; ms += 30) history.add(frame(ms), Duration::zero(), at(ms + 8));
  const auto head = history.head_at(at(45));
  ASSERT_TRUE(head);
  EXPECT_NEAR(head->pose.position.x, 0.045, 1e-12);
  const auto camera = history.camera_at(2, at(25));
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->kind, PoseKind::exact);
  EXPECT_NEAR(camera->pose.position.y, 0.060, 1e-12);
  const auto fingers = history.fingers_at(at(15));
  ASSERT_TRUE(fingers[3] && fingers[4]);
  EXPECT_NEAR(fingers[3]->position.z, 0.03 + 0.0015, 1e-12);
  EXPECT_TRUE(fingers[3]->seen);
  EXPECT_FALSE(fingers[4]->seen);
  EXPECT_FALSE(history.camera_at(0, at(25)));
  ASSERT_EQ(history.status().cameras.size(), 1U);
  EXPECT_TRUE(history.status().cameras[0].on_head);
}

TEST(TrackingHistory, ShiftsTheDaemonsTimesToOurs) {
  TrackingHistory history;
  history.add(frame(0), milliseconds(500), at(510));
  EXPECT_FALSE(history.head_at(at(0)));
  EXPECT_TRUE(history.head_at(at(500)));
  EXPECT_EQ(history.status().capture_time, at(500));
}

TEST(TrackingHistory, ALostFingerIsAbsent) {
  TrackingHistory history;
  v1::TrackingFrame lost = frame(0);
  lost.mutable_hands(0)->set_fingertip_states(1, v1::TRACKING_LOST);
  history.add(lost, Duration::zero(), at(1));
  EXPECT_FALSE(history.fingers_at(at(0))[1]);
  EXPECT_TRUE(history.fingers_at(at(0))[0]);
}

TEST(TrackingHistory, RemembersLensNameAndColoursThatAreToldNowAndThen) {
  TrackingHistory history;
  v1::TrackingFrame slim = frame(0);
  v1::CameraState& moved = *slim.mutable_cameras(0);
  moved.clear_width_px();
  moved.clear_height_px();
  moved.clear_fx_px();
  moved.clear_fy_px();
  history.add(slim, Duration::zero(), at(1));
  EXPECT_TRUE(history.status().cameras.empty()) << "nothing is known of its lens yet";
  EXPECT_EQ(history.status().refused, 0U) << "which is no fault";
  EXPECT_FALSE(history.status().finger_colours.has_value());

  v1::TrackingFrame whole = frame(30);
  whole.mutable_cameras(0)->set_name("head");
  for (std::uint32_t i = 0; i < 5; ++i) whole.add_fingertip_colours(0x102030 + i);
  history.add(whole, Duration::zero(), at(31));
  slim.set_capture_time_ns(to_ns(at(60)));
  moved.set_exposure_time_ns(to_ns(at(55)));
  moved.mutable_world_from_camera()->mutable_position()->set_y(0.5);
  history.add(slim, Duration::zero(), at(61));
  ASSERT_EQ(history.status().cameras.size(), 1U);
  EXPECT_EQ(history.status().cameras[0].name, "head");
  EXPECT_EQ(history.status().cameras[0].pinhole.width_px, 640);
  EXPECT_NEAR(history.camera_at(2, at(55))->pose.position.y, 0.5, 1e-12) << "its pose is the new one";
  ASSERT_TRUE(history.status().finger_colours.has_value());
  EXPECT_EQ((*history.status().finger_colours)[4], 0x102034U);
  history.clear();
  EXPECT_FALSE(history.status().finger_colours.has_value());
}

TEST(TrackingHistory, PassesOverNonsenseAndCountsIt) {
  TrackingHistory history;
  v1::TrackingFrame bad = frame(0);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  bad.mutable_head()->mutable_world_from_head()->mutable_position()->set_x(nan);
  bad.mutable_hands(0)->set_pressure(nan);
  bad.mutable_hands(0)->set_fingertip_positions(1, nan);
  bad.mutable_cameras(0)->set_fx_px(nan);
  for (std::uint32_t i = 0; i < 100; ++i) {
    v1::CameraState& camera = *bad.add_cameras();
    camera = frame(0).cameras(0);
    camera.set_camera(100 + i);
  }
  history.add(bad, Duration::zero(), at(1));
  EXPECT_FALSE(history.head_at(at(0)));
  EXPECT_FALSE(history.fingers_at(at(0))[0]);
  EXPECT_EQ(history.status().hand->pressure, 0.0);
  EXPECT_LE(history.status().cameras.size(), 16U);
  EXPECT_GE(history.status().refused, 3U);
}

TEST(TrackingHistory, RefusesTimesWhoseSumsWouldOverflow_V5) {
  for (const std::int64_t time_ns : {std::numeric_limits<std::int64_t>::max(),
                                     std::numeric_limits<std::int64_t>::min(), std::int64_t{-1}}) {
    TrackingHistory history;
    v1::TrackingFrame late = frame(0);
    late.set_capture_time_ns(time_ns);
    history.add(late, std::chrono::hours(1), at(8));
    EXPECT_EQ(history.status().refused, 1U) << time_ns;
    EXPECT_FALSE(history.head_at(at(0)));
    v1::TrackingFrame camera = frame(0);
    camera.mutable_cameras(0)->set_exposure_time_ns(time_ns);
    history.add(camera, Duration::zero(), at(8));
    EXPECT_EQ(history.status().refused, 2U) << time_ns;
    EXPECT_TRUE(history.head_at(at(0))) << "the rest of the frame is good";
    EXPECT_FALSE(history.camera_at(2, at(0)));
  }
}

TEST(TrackingHistory, RefusesWhatNothingInARoomDoes_V5) {
  TrackingHistory history;
  v1::TrackingFrame fast = frame(0);
  fast.mutable_head()->mutable_linear_velocity()->set_x(1e300);
  history.add(fast, Duration::zero(), at(8));
  EXPECT_FALSE(history.head_at(at(20)));
  fast = frame(30);
  fast.mutable_head()->mutable_world_from_head()->mutable_position()->set_y(1e9);
  history.add(fast, Duration::zero(), at(38));
  EXPECT_FALSE(history.head_at(at(30)));
  EXPECT_EQ(history.status().refused, 2U);
}

}  // namespace
}  // namespace handloft::client
