#include "daemon-tracking/publish/tracking_message.h"

namespace handloft::tracking {

namespace {

void set(const Eigen::Vector3d& from, v1::Vec3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

void set(const Eigen::Quaterniond& from, v1::Quaternion& to) {
  to.set_w(from.w());
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

v1::TrackingState to_message(TrackingState state) {
  switch (state) {
    case TrackingState::lost:
      return v1::TRACKING_LOST;
    case TrackingState::predicted:
      return v1::TRACKING_PREDICTED;
    case TrackingState::single:
      return v1::TRACKING_SINGLE;
    case TrackingState::tracked:
      return v1::TRACKING_TRACKED;
  }
  return v1::TRACKING_LOST;
}

v1::Gesture to_message(const FusedHand& hand) {
  if (hand.table_by_contact) return v1::GESTURE_ON_TABLE;
  switch (hand.gesture) {
    case Gesture::open:
      return v1::GESTURE_OPEN;
    case Gesture::closed:
      return v1::GESTURE_CLOSED;
    case Gesture::pointing:
      return v1::GESTURE_POINTING;
    case Gesture::unknown:
      return v1::GESTURE_UNKNOWN;
  }
  return v1::GESTURE_UNKNOWN;
}

template <typename Matrix>
void append_rows(const Matrix& matrix, google::protobuf::RepeatedField<double>& to) {
  to.Reserve(static_cast<int>(matrix.size()));
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) to.Add(matrix(row, column));
  }
}

void fill(const FusedHead& head, v1::HeadState& to) {
  to.set_state(to_message(head.state));
  to.set_camera_mask(head.camera_mask);
  to.set_tag_count(head.tags);
  if (!head.position_valid || !head.orientation_valid) return;
  set(head.position_m, *to.mutable_world_from_head()->mutable_position());
  set(head.orientation, *to.mutable_world_from_head()->mutable_orientation());
  set(head.velocity_m_s, *to.mutable_linear_velocity());
  set(head.angular_velocity_rad_s, *to.mutable_angular_velocity());
  append_rows(head.covariance, *to.mutable_covariance());
  to.set_reprojection_rms_px(head.reprojection_rms_px);
}

void fill(const FusedHand& hand, v1::HandState& to) {
  for (int finger = 0; finger < finger_count; ++finger) {
    const FusedTip& tip = hand.tips[static_cast<std::size_t>(finger)];
    v1::FingertipState& tip_message = *to.add_fingertips();
    tip_message.set_finger(static_cast<v1::Finger>(finger));
    tip_message.set_state(to_message(tip.state));
    tip_message.set_camera_mask(tip.camera_mask);
    if (tip.state == TrackingState::lost) continue;
    set(tip.position_m, *tip_message.mutable_position());
    set(tip.velocity_m_s, *tip_message.mutable_velocity());
    append_rows(tip.covariance_m2, *tip_message.mutable_covariance());
  }
  to.set_gesture(to_message(hand));
  to.set_gesture_since_ns(to_ns(hand.gesture_since));
  to.set_pressure(hand.pressure);
  to.set_pressure_raw(hand.raw_force);
  to.set_pressing(hand.pressing);
  to.set_potentiometer(hand.potentiometer);
  to.set_potentiometer_raw(hand.raw_potentiometer);
  to.set_contacts(hand.contacts);
  to.set_table_by_contact(hand.table_by_contact);
  to.set_table_by_height(hand.table_by_height);
  to.set_glove_present(hand.glove_present);
  to.set_battery_percent(hand.battery_percent);
}

void fill(const ShownFrame& shown, const Rig& rig, v1::CameraState& to) {
  const CameraCalibration& camera = rig.cameras.at(shown.camera);
  to.set_camera(shown.camera);
  to.set_name(camera.name);
  set(shown.world_from_camera.translation(), *to.mutable_world_from_camera()->mutable_position());
  set(Eigen::Quaterniond(shown.world_from_camera.rotation()),
      *to.mutable_world_from_camera()->mutable_orientation());
  to.set_state(to_message(shown.state));
  const CameraIntrinsics& lens = camera.intrinsics;
  to.set_width_px(static_cast<std::uint32_t>(lens.width_px));
  to.set_height_px(static_cast<std::uint32_t>(lens.height_px));
  to.set_fx_px(lens.fx_px);
  to.set_fy_px(lens.fy_px);
  to.set_cx_px(lens.cx_px);
  to.set_cy_px(lens.cy_px);
  for (const double coefficient : lens.distortion) to.add_distortion(coefficient);
  to.set_exposure_time_ns(to_ns(shown.exposure_time));
  to.set_on_head(camera.role == CameraRole::head);
}

}  // namespace

void fill_tracking_frame(const FusedState& state, const Rig& rig, const std::vector<ShownFrame>& shown,
                         const std::vector<DeviceReport>& devices, v1::TrackingFrame& frame) {
  frame.Clear();
  frame.set_sequence(state.sequence);
  frame.set_capture_time_ns(to_ns(state.time));
  frame.set_source_camera(state.camera);
  fill(state.head, *frame.mutable_head());
  fill(state.hand, *frame.add_hands());
  for (const ShownFrame& camera : shown) fill(camera, rig, *frame.add_cameras());
  for (const DeviceReport& device : devices) {
    v1::DeviceHealth& health = *frame.add_devices();
    health.set_device(device.device);
    health.set_present(device.present);
    health.set_rate_hz(device.rate_hz);
    health.set_samples(device.samples);
    health.set_dropped(device.dropped);
    health.set_last_sample_ns(to_ns(device.last_sample));
    health.set_problem(device.problem);
  }
}

}  // namespace handloft::tracking
