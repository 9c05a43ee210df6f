#include "daemon-tracking/publish/tracking_message.h"

#include <algorithm>
#include <cmath>

#include "common/codec/fingertips.h"
#include "daemon-tracking/source/glove_report.h"

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

// What the glove reports and what is published are the same bits.
static_assert(contact_index == 1U << v1::CONTACT_PAD_INDEX &&
              contact_middle == 1U << v1::CONTACT_PAD_MIDDLE && contact_ring == 1U << v1::CONTACT_PAD_RING &&
              contact_little == 1U << v1::CONTACT_PAD_LITTLE &&
              contact_thumb == 1U << v1::CONTACT_PAD_THUMB && contact_table == 1U << v1::CONTACT_PAD_TABLE);

template <typename Matrix>
void append_upper_triangle(const Matrix& matrix, google::protobuf::RepeatedField<float>& to) {
  to.Reserve(static_cast<int>(matrix.rows() * (matrix.rows() + 1) / 2));
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = row; column < matrix.cols(); ++column)
      to.Add(static_cast<float>(matrix(row, column)));
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
  append_upper_triangle(head.covariance, *to.mutable_covariance());
  to.set_reprojection_rms_px(head.reprojection_rms_px);
}

void fill(const FusedHand& hand, v1::HandState& to) {
  codec::Fingertips tips;
  static_assert(codec::fingertip_count == static_cast<std::size_t>(finger_count));
  for (std::size_t i = 0; i < tips.size(); ++i) {
    const FusedTip& from = hand.tips[i];
    tips[i].state = to_message(from.state);
    tips[i].camera_mask = from.camera_mask;
    Eigen::Map<Eigen::Vector3d>(tips[i].position_m.data()) = from.position_m;
    Eigen::Map<Eigen::Vector3f>(tips[i].velocity_m_s.data()) = from.velocity_m_s.cast<float>();
    const Eigen::Matrix3d& covariance = from.covariance_m2;
    tips[i].covariance_m2 = {static_cast<float>(covariance(0, 0)), static_cast<float>(covariance(0, 1)),
                             static_cast<float>(covariance(0, 2)), static_cast<float>(covariance(1, 1)),
                             static_cast<float>(covariance(1, 2)), static_cast<float>(covariance(2, 2))};
  }
  codec::pack_fingertips(tips, to);
  to.set_gesture(to_message(hand));
  // A hand on the table is a gesture of its own: it begins and ends with the table's pad.
  const TimePoint since =
      hand.table_by_contact ? hand.table_since : std::max(hand.gesture_since, hand.table_since);
  to.set_gesture_since_ns(to_ns(since));
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

void fill(const FusedPen& pen, v1::PenState& to) {
  to.set_present(pen.present);
  to.set_in_proximity(pen.in_proximity);
  to.set_eraser(pen.eraser);
  to.mutable_position()->set_x(pen.position_m.x());
  to.mutable_position()->set_y(pen.position_m.y());
  to.set_pressure(pen.pressure);
  to.mutable_tilt()->set_x(pen.tilt_rad.x());
  to.mutable_tilt()->set_y(pen.tilt_rad.y());
  to.set_buttons(pen.buttons);
  to.set_capture_time_ns(to_ns(pen.time));
}

void fill(const FusedSpaceMouse& mouse, v1::SpaceMouseState& to) {
  to.set_present(mouse.present);
  set(mouse.translation, *to.mutable_translation());
  set(mouse.rotation, *to.mutable_rotation());
  to.set_buttons(mouse.buttons);
  to.set_capture_time_ns(to_ns(mouse.time));
}

// A device that was never there is left out; one that has gone is told as absent.
template <typename Device>
bool was_ever_there(const Device& device) {
  return device.present || device.time != TimePoint{};
}

void fill(const ShownFrame& shown, CameraRole role, v1::CameraState& to) {
  to.set_camera(shown.camera);
  set(shown.world_from_camera.translation(), *to.mutable_world_from_camera()->mutable_position());
  set(Eigen::Quaterniond(shown.world_from_camera.rotation()),
      *to.mutable_world_from_camera()->mutable_orientation());
  to.set_state(to_message(shown.state));
  to.set_exposure_time_ns(to_ns(shown.exposure_time));
  to.set_on_head(role == CameraRole::head);
}

void fill_lens(const CameraCalibration& camera, v1::CameraState& to) {
  to.set_name(camera.name);
  const CameraIntrinsics& lens = camera.intrinsics;
  to.set_width_px(static_cast<std::uint32_t>(lens.width_px));
  to.set_height_px(static_cast<std::uint32_t>(lens.height_px));
  to.set_fx_px(lens.fx_px);
  to.set_fy_px(lens.fy_px);
  to.set_cx_px(lens.cx_px);
  to.set_cy_px(lens.cy_px);
  for (const double coefficient : lens.distortion) to.add_distortion(coefficient);
}

void fill(const DeviceReport& device, v1::DeviceHealth& to) {
  to.set_device(device.device);
  to.set_present(device.present);
  to.set_rate_hz(device.rate_hz);
  to.set_samples(device.samples);
  to.set_dropped(device.dropped);
  to.set_last_sample_ns(to_ns(device.last_sample));
  to.set_problem(device.problem);
  to.set_identity(device.identity);
  to.set_asked_rate_hz(device.asked_rate_hz);
  to.set_refused(device.refused);
}

}  // namespace

std::uint32_t srgb_of(const FingertipColour& colour) {
  // JFIF 1.02: full-range BT.601, both differences centred on 128.
  const double cb = colour.cb - 128.0, cr = colour.cr - 128.0;
  const auto channel = [](double value) {
    return static_cast<std::uint32_t>(std::lround(std::clamp(value, 0.0, 255.0)));
  };
  return channel(colour.y + 1.402 * cr) << 16 | channel(colour.y - 0.344136 * cb - 0.714136 * cr) << 8 |
         channel(colour.y + 1.772 * cb);
}

void fill_tracking_frame(const FusedState& state, const Rig& rig, const std::vector<ShownFrame>& shown,
                         v1::TrackingFrame& frame) {
  frame.Clear();
  frame.set_sequence(state.sequence);
  frame.set_capture_time_ns(to_ns(state.time));
  frame.set_source_camera(state.camera);
  fill(state.head, *frame.mutable_head());
  fill(state.hand, *frame.add_hands());
  if (was_ever_there(state.pen)) fill(state.pen, *frame.mutable_pen());
  if (was_ever_there(state.space_mouse)) fill(state.space_mouse, *frame.mutable_space_mouse());
  for (const ShownFrame& camera : shown) {
    if (camera.camera == state.camera) fill(camera, rig.cameras.at(camera.camera).role, *frame.add_cameras());
  }
}

void add_standing_parts(const Rig& rig, const std::vector<ShownFrame>& shown,
                        const std::vector<DeviceReport>& devices, v1::TrackingFrame& frame) {
  frame.clear_cameras();
  for (const ShownFrame& camera : shown) {
    const CameraCalibration& calibration = rig.cameras.at(camera.camera);
    fill(camera, calibration.role, *frame.add_cameras());
    fill_lens(calibration, *frame.mutable_cameras(frame.cameras_size() - 1));
  }
  for (const DeviceReport& device : devices) fill(device, *frame.add_devices());
  for (const FingertipColour& colour : rig.colours) frame.add_fingertip_colours(srgb_of(colour));
}

void copy_standing_parts(const v1::TrackingFrame& from, v1::TrackingFrame& to) {
  for (const v1::CameraState& camera : from.cameras()) {
    const auto known =
        std::find_if(to.mutable_cameras()->begin(), to.mutable_cameras()->end(),
                     [&](const v1::CameraState& each) { return each.camera() == camera.camera(); });
    if (known == to.mutable_cameras()->end()) {
      *to.add_cameras() = camera;
      continue;
    }
    v1::CameraState whole = camera;
    *whole.mutable_world_from_camera() = known->world_from_camera();
    whole.set_state(known->state());
    whole.set_exposure_time_ns(known->exposure_time_ns());
    *known = std::move(whole);
  }
  if (to.devices_size() == 0) *to.mutable_devices() = from.devices();
  *to.mutable_fingertip_colours() = from.fingertip_colours();
  if (from.has_latency()) *to.mutable_latency() = from.latency();
}

bool has_standing_parts(const v1::TrackingFrame& frame) {
  return frame.fingertip_colours_size() > 0;
}

}  // namespace handloft::tracking
