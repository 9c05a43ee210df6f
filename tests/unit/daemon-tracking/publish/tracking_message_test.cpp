// The fused state as a message (T14): whole, in the order that the proto promises, nothing of what is lost.

#include "daemon-tracking/publish/tracking_message.h"

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
  fill_tracking_frame(state, default_rig(), {}, {}, frame);
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
  ASSERT_EQ(frame.head().covariance_size(), 36);
  EXPECT_EQ(frame.head().covariance(7), 7.0) << "row-major";
  ASSERT_EQ(frame.hands_size(), 1);
  const v1::HandState& hand = frame.hands(0);
  ASSERT_EQ(hand.fingertips_size(), 5);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(hand.fingertips(i).finger(), static_cast<v1::Finger>(i));
    EXPECT_EQ(hand.fingertips(i).position().x(), i);
    EXPECT_EQ(hand.fingertips(i).velocity().y(), -1);
    EXPECT_EQ(hand.fingertips(i).covariance_size(), 9);
  }
  EXPECT_EQ(hand.gesture(), v1::GESTURE_POINTING);
  EXPECT_EQ(hand.gesture_since_ns(), 77);
  EXPECT_EQ(hand.pressure(), 0.75);
  EXPECT_TRUE(hand.pressing());
}

TEST(TrackingMessage, WhatIsLostHasNoValueT6) {
  FusedState state = state_with_everything();
  state.hand.tips[1].state = TrackingState::lost;
  state.head.orientation_valid = false;
  const v1::TrackingFrame frame = message_of(state);
  EXPECT_EQ(frame.hands(0).fingertips(1).state(), v1::TRACKING_LOST);
  EXPECT_FALSE(frame.hands(0).fingertips(1).has_position());
  EXPECT_TRUE(frame.hands(0).fingertips(2).has_position());
  EXPECT_FALSE(frame.head().has_world_from_head());
}

TEST(TrackingMessage, AHandOnTheTableIsThatGestureT10) {
  FusedState state = state_with_everything();
  state.hand.table_by_height = true;
  EXPECT_EQ(message_of(state).hands(0).gesture(), v1::GESTURE_POINTING) << "low is not yet lying";
  state.hand.table_by_contact = true;
  EXPECT_EQ(message_of(state).hands(0).gesture(), v1::GESTURE_ON_TABLE);
}

TEST(TrackingMessage, CamerasComeWithLensAndPlaceV1) {
  const Rig rig = default_rig();
  ShownFrame shown;
  shown.camera = 2;
  shown.exposure_time = from_ns(42);
  shown.world_from_camera.translation() = Eigen::Vector3d(1, 2, 3);
  shown.state = TrackingState::tracked;
  v1::TrackingFrame frame;
  fill_tracking_frame(FusedState{}, rig, {shown}, {}, frame);
  ASSERT_EQ(frame.cameras_size(), 1);
  const v1::CameraState& camera = frame.cameras(0);
  EXPECT_EQ(camera.camera(), 2u);
  EXPECT_EQ(camera.name(), rig.cameras[2].name);
  EXPECT_EQ(camera.exposure_time_ns(), 42);
  EXPECT_EQ(camera.world_from_camera().position().y(), 2);
  EXPECT_EQ(camera.fx_px(), rig.cameras[2].intrinsics.fx_px);
  EXPECT_EQ(camera.distortion_size(), 5);
  EXPECT_EQ(camera.on_head(), rig.cameras[2].role == CameraRole::head);
}

}  // namespace
}  // namespace handloft::tracking
