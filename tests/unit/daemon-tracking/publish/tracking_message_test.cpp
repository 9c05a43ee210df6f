// The fused state as a message (T14): whole, in the order that the proto promises, nothing of what is lost.

#include "daemon-tracking/publish/tracking_message.h"
#include "common/codec/fingertips.h"

#include <gtest/gtest.h>

namespace handloft::tracking {
namespace {

FusedState state_with_everything() {
  FusedState state;
  state.time = from_ns(123'456);
  state.sequence = 9;
  state.camera = 2;
  state.head.state = TrackingState::tracked;
  state.head.position_valid = state.head.orientation_valid = true;
  state.head.position_m = {0.1, 0.2, 0.3};
  state.head.orientation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  for (int i = 0; i < 36; ++i) state.head.covariance(i / 6, i % 6) = i;
  state.head.camera_mask = 5;
  for (std::size_t i = 0; i < finger_count; ++i) {
    state.hand.tips[i].state = TrackingState::single;
    state.hand.tips[i].position_m = {static_cast<double>(i), 0, 1};
    state.hand.tips[i].velocity_m_s = {0, -1, 0};
  }
  state.hand.pressure = 0.75;
  state.hand.pressing = true;
  state.hand.gesture = Gesture::pointing;
  state.hand.gesture_since = from_ns(77);
  return state;
}

v1::TrackingFrame message_of(const FusedState& state) {
  v1::TrackingFrame frame;
  frame.set_end_of_recording(true);  // of an earlier use: must go
  fill_tracking_frame(state, default_rig(), {}, frame);
  return frame;
}

TEST(TrackingMessage, CarriesTheWholeStateT14) {
  const v1::TrackingFrame frame = message_of(state_with_everything());
  EXPECT_EQ(frame.sequence(), 9u);
  EXPECT_EQ(frame.capture_time_ns(), 123'456);
  EXPECT_EQ(frame.source_camera(), 2u);
  EXPECT_FALSE(frame.end_of_recording());
  EXPECT_EQ(frame.head().state(), v1::TRACKING_TRACKED);
  EXPECT_EQ(frame.head().world_from_head().position().z(), 0.3);
  EXPECT_EQ(frame.head().world_from_head().orientation().w(), 0.5);
  EXPECT_EQ(frame.head().world_from_head().orientation().y(), -0.5);
  ASSERT_EQ(frame.head().covariance_size(), 21);
  EXPECT_EQ(frame.head().covariance(0), 0.0F);
  EXPECT_EQ(frame.head().covariance(5), 5.0F) << "the end of the first row";
  EXPECT_EQ(frame.head().covariance(6), 7.0F) << "the second begins on the diagonal";
  EXPECT_EQ(frame.head().covariance(20), 35.0F);
  ASSERT_EQ(frame.hands_size(), 1);
  const v1::HandState& hand = frame.hands(0);
  const auto tips = codec::unpack_fingertips(hand);
  ASSERT_TRUE(tips.ok());
  for (std::size_t i = 0; i < tips->size(); ++i) {
    EXPECT_EQ((*tips)[i].state, v1::TRACKING_SINGLE);
    EXPECT_EQ((*tips)[i].position_m[0], static_cast<double>(i));
    EXPECT_EQ((*tips)[i].velocity_m_s[1], -1.0F);
  }
  EXPECT_EQ(hand.fingertip_covariances_size(), 5 * 6);
  EXPECT_EQ(hand.gesture(), v1::GESTURE_POINTING);
  EXPECT_EQ(hand.gesture_since_ns(), 77);
  EXPECT_EQ(hand.pressure(), 0.75);
  EXPECT_TRUE(hand.pressing());
}

std::vector<ShownFrame> three_shown() {
  std::vector<ShownFrame> shown(3);
  for (std::uint32_t i = 0; i < 3; ++i) {
    shown[i].camera = i;
    shown[i].exposure_time = from_ns(100 + i);
    shown[i].world_from_camera.translation() = Eigen::Vector3d(0.0, i, 1.0);
    shown[i].state = TrackingState::tracked;
  }
  return shown;
}

DeviceReport glove() {
  DeviceReport report;
  report.device = "glove";
  return report;
}

TEST(TrackingMessage, OnlyTheCameraThatSawComesWithEachFrame) {
  v1::TrackingFrame frame;
  fill_tracking_frame(state_with_everything(), default_rig(), three_shown(), frame);
  ASSERT_EQ(frame.cameras_size(), 1);
  EXPECT_EQ(frame.cameras(0).camera(), 2u);
  EXPECT_EQ(frame.cameras(0).exposure_time_ns(), 102);
  EXPECT_TRUE(frame.cameras(0).on_head());
  EXPECT_EQ(frame.cameras(0).width_px(), 0u) << "no lens";
  EXPECT_FALSE(has_standing_parts(frame));
  EXPECT_LT(frame.ByteSizeLong(), 900u);
}

TEST(TrackingMessage, StandingPartsAreAllCamerasDevicesAndColours) {
  const Rig rig = default_rig();
  v1::TrackingFrame frame;
  fill_tracking_frame(state_with_everything(), rig, three_shown(), frame);
  add_standing_parts(rig, three_shown(), {glove()}, frame);
  EXPECT_TRUE(has_standing_parts(frame));
  ASSERT_EQ(frame.cameras_size(), 3);
  for (int i = 0; i < 3; ++i) {
    const CameraCalibration& camera = rig.cameras[static_cast<std::size_t>(i)];
    EXPECT_EQ(frame.cameras(i).name(), camera.name);
    EXPECT_EQ(frame.cameras(i).fx_px(), camera.intrinsics.fx_px);
    EXPECT_EQ(frame.cameras(i).distortion_size(), 5);
    EXPECT_EQ(frame.cameras(i).world_from_camera().position().y(), i);
  }
  ASSERT_EQ(frame.devices_size(), 1);
  EXPECT_EQ(frame.devices(0).device(), "glove");
  ASSERT_EQ(frame.fingertip_colours_size(), 5);
}

TEST(TrackingMessage, AFirstFrameIsMadeWholeFromAnEarlierOne) {
  const Rig rig = default_rig();
  std::vector<ShownFrame> shown = three_shown();
  v1::TrackingFrame earlier, newest;
  fill_tracking_frame(state_with_everything(), rig, shown, earlier);
  add_standing_parts(rig, shown, {glove()}, earlier);
  shown[2].world_from_camera.translation() = Eigen::Vector3d::Zero();
  shown[2].state = TrackingState::lost;
  shown[2].exposure_time = from_ns(900);
  fill_tracking_frame(state_with_everything(), rig, shown, newest);
  copy_standing_parts(earlier, newest);
  ASSERT_EQ(newest.cameras_size(), 3);
  EXPECT_EQ(newest.cameras(0).camera(), 2u);
  EXPECT_EQ(newest.cameras(0).fx_px(), rig.cameras[2].intrinsics.fx_px);
  EXPECT_EQ(newest.cameras(0).world_from_camera().position().z(), 0.0)
      << "its pose stays the newest, zero too";
  EXPECT_EQ(newest.cameras(0).state(), v1::TRACKING_LOST);
  EXPECT_EQ(newest.cameras(0).exposure_time_ns(), 900);
  EXPECT_EQ(newest.cameras(1).name(), "left");
  EXPECT_EQ(newest.devices_size(), 1);
  EXPECT_EQ(newest.fingertip_colours_size(), 5);
}

TEST(TrackingMessage, ColoursAreJpegsOwnAsSrgb) {
  // The display client's table until it is told: it must agree with the default rig.
  const std::array<std::uint32_t, finger_count> expected{0xDC2833, 0x28BD3B, 0x2846DC, 0xE6D11E, 0xD232C8};
  const Rig rig = default_rig();
  for (std::size_t i = 0; i < finger_count; ++i) EXPECT_EQ(srgb_of(rig.colours[i]), expected[i]) << i;
  EXPECT_EQ(srgb_of({Finger::thumb, 255, 128, 128}), 0xFFFFFFu);
  EXPECT_EQ(srgb_of({Finger::thumb, 76.245, 84.0, 256.0}), 0xFF0000u)
      << "pure red: beyond both ends is clamped";
}

TEST(TrackingMessage, WhatIsLostHasNoValueT6) {
  FusedState state = state_with_everything();
  state.hand.tips[1].state = TrackingState::lost;
  state.head.orientation_valid = false;
  const v1::TrackingFrame frame = message_of(state);
  const auto tips = codec::unpack_fingertips(frame.hands(0));
  ASSERT_TRUE(tips.ok());
  EXPECT_EQ((*tips)[1].state, v1::TRACKING_LOST);
  EXPECT_EQ((*tips)[1].position_m, (std::array<double, 3>{}));
  EXPECT_EQ((*tips)[2].position_m[0], 2.0);
  EXPECT_FALSE(frame.head().has_world_from_head());
}

TEST(TrackingMessage, AHandOnTheTableIsThatGestureT10) {
  FusedState state = state_with_everything();
  state.hand.table_by_height = true;
  EXPECT_EQ(message_of(state).hands(0).gesture(), v1::GESTURE_POINTING) << "low is not yet lying";
  state.hand.table_by_contact = true;
  EXPECT_EQ(message_of(state).hands(0).gesture(), v1::GESTURE_ON_TABLE);
}

TEST(TrackingMessage, TheTableGestureHasItsOwnBeginningAndEndT10) {
  FusedState state = state_with_everything();  // Pointing since 77.
  state.hand.table_by_contact = true;
  state.hand.table_since = from_ns(200);
  EXPECT_EQ(message_of(state).hands(0).gesture_since_ns(), 200);
  state.hand.table_by_contact = false;  // It was lifted at 300; pointing is what it does since then.
  state.hand.table_since = from_ns(300);
  EXPECT_EQ(message_of(state).hands(0).gesture_since_ns(), 300);
  state.hand.gesture_since = from_ns(400);
  EXPECT_EQ(message_of(state).hands(0).gesture_since_ns(), 400);
}

TEST(TrackingMessage, CarriesPenAnd3dMouseOnceTheyWereThereT14) {
  FusedState state = state_with_everything();
  EXPECT_FALSE(message_of(state).has_pen());
  EXPECT_FALSE(message_of(state).has_space_mouse());
  state.pen.present = state.pen.in_proximity = true;
  state.pen.position_m = {0.1, 0.05};
  state.pen.pressure = 0.5;
  state.pen.tilt_rad = {0.2, -0.3};
  state.pen.buttons = 3;
  state.pen.time = from_ns(55);
  state.space_mouse.present = true;
  state.space_mouse.translation = {1, -0.5, 0.25};
  state.space_mouse.rotation = {0, 0, -1};
  state.space_mouse.buttons = 2;
  state.space_mouse.time = from_ns(56);
  v1::TrackingFrame frame = message_of(state);
  EXPECT_TRUE(frame.pen().present());
  EXPECT_TRUE(frame.pen().in_proximity());
  EXPECT_FALSE(frame.pen().eraser());
  EXPECT_EQ(frame.pen().position().x(), 0.1);
  EXPECT_EQ(frame.pen().position().y(), 0.05);
  EXPECT_EQ(frame.pen().pressure(), 0.5);
  EXPECT_EQ(frame.pen().tilt().y(), -0.3);
  EXPECT_EQ(frame.pen().buttons(), 3u);
  EXPECT_EQ(frame.pen().capture_time_ns(), 55);
  EXPECT_TRUE(frame.space_mouse().present());
  EXPECT_EQ(frame.space_mouse().translation().y(), -0.5);
  EXPECT_EQ(frame.space_mouse().rotation().z(), -1.0);
  EXPECT_EQ(frame.space_mouse().buttons(), 2u);
  EXPECT_EQ(frame.space_mouse().capture_time_ns(), 56);
  // Unplugged: told as absent, so that nobody goes on pushing.
  state.space_mouse = {};
  state.space_mouse.time = from_ns(57);
  frame = message_of(state);
  ASSERT_TRUE(frame.has_space_mouse());
  EXPECT_FALSE(frame.space_mouse().present());
  EXPECT_EQ(frame.space_mouse().translation().x(), 0.0);
}

}  // namespace
}  // namespace handloft::tracking
