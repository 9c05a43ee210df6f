#include <algorithm>
#include <cmath>
#include <cstdint>

#include "client-hmd/view/tracking_feed.h"
#include "common/codec/fingertips.h"

namespace handloft::client {
namespace {

glm::dvec3 vector_of(const v1::Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

RigidPose pose_of(const v1::Pose& pose) {
  const v1::Quaternion& q = pose.orientation();
  return {vector_of(pose.position()), {q.w(), q.x(), q.y(), q.z()}};
}

/// 36 years of a monotonic clock: sums and differences of times within this are no overflow.
bool is_time(std::int64_t ns) {
  constexpr std::int64_t latest_ns = std::int64_t{1} << 60;
  return ns >= 0 && ns <= latest_ns;
}

bool usable(v1::TrackingState state) {
  return state == v1::TRACKING_TRACKED || state == v1::TRACKING_SINGLE || state == v1::TRACKING_PREDICTED;
}

std::optional<Pinhole> pinhole_of(const v1::CameraState& state) {
  constexpr std::uint32_t max_side_px = 16384;
  if (state.width_px() > max_side_px || state.height_px() > max_side_px) return std::nullopt;
  Pinhole camera;
  camera.width_px = static_cast<int>(state.width_px());
  camera.height_px = static_cast<int>(state.height_px());
  camera.fx_px = state.fx_px();
  camera.fy_px = state.fy_px();
  camera.cx_px = state.cx_px();
  camera.cy_px = state.cy_px();
  const int terms = std::min(state.distortion_size(), static_cast<int>(camera.distortion.size()));
  for (int i = 0; i < terms; ++i) camera.distortion[static_cast<std::size_t>(i)] = state.distortion(i);
  if (!check_pinhole(camera)) return std::nullopt;
  return camera;
}

}  // namespace

void TrackingHistory::clear() {
  head_.clear();
  for (PoseHistory& finger : fingers_) finger.clear();
  finger_states_.fill(v1::TRACKING_LOST);
  cameras_.clear();
  status_.hand.reset();
  status_.finger_colours.reset();
  status_.end_of_recording = false;
}

void TrackingHistory::add(const v1::TrackingFrame& frame, Duration to_local, TimePoint received) {
  ++status_.frames;
  if (!is_time(frame.capture_time_ns())) {
    ++status_.refused;
    return;
  }
  const TimePoint time = from_ns(frame.capture_time_ns()) + to_local;
  status_.received_at = received;
  status_.capture_time = time;
  status_.end_of_recording = status_.end_of_recording || frame.end_of_recording();
  if (frame.has_head()) add_head(frame.head(), time);
  if (frame.hands_size() > 0) add_hand(frame.hands(0), time);
  for (const v1::CameraState& state : frame.cameras()) add_camera(state, to_local);
  if (frame.fingertip_colours_size() == static_cast<int>(finger_count)) {
    std::array<std::uint32_t, finger_count> colours{};
    std::copy(frame.fingertip_colours().begin(), frame.fingertip_colours().end(), colours.begin());
    status_.finger_colours = colours;
  }
  status_.cameras.clear();
  for (const Camera& camera : cameras_) status_.cameras.push_back(camera.camera);
}

/// What is known already (a frame repeats the last exposure of the other cameras) is no fault; nonsense is.
void TrackingHistory::push(PoseHistory& history, const MeasuredPose& sample) {
  if (history.newest() == sample.time) return;
  if (!history.push(sample)) ++status_.refused;
}

void TrackingHistory::add_head(const v1::HeadState& head, TimePoint time) {
  if (!usable(head.state())) return;
  const MeasuredPose sample{time, pose_of(head.world_from_head()), vector_of(head.linear_velocity()),
                            vector_of(head.angular_velocity())};
  push(head_, sample);
}

void TrackingHistory::add_hand(const v1::HandState& hand, TimePoint time) {
  HandStatus status;
  status.gesture = hand.gesture();
  status.pressure = std::isfinite(hand.pressure()) ? std::clamp(hand.pressure(), 0.0, 1.0) : 0.0;
  status.pressing = hand.pressing();
  status.glove_present = hand.glove_present();
  status.battery_percent = std::min(hand.battery_percent(), 100U);
  status_.hand = status;
  const auto tips = codec::unpack_fingertips(hand);
  if (!tips) {
    ++status_.refused;
    finger_states_.fill(v1::TRACKING_LOST);
    return;
  }
  static_assert(codec::fingertip_count == finger_count);
  for (std::size_t i = 0; i < finger_count; ++i) {
    const codec::FingertipRecord& tip = (*tips)[i];
    finger_states_[i] = tip.state;
    if (!usable(tip.state)) continue;
    MeasuredPose sample;
    sample.time = time;
    sample.pose.position = {tip.position_m[0], tip.position_m[1], tip.position_m[2]};
    sample.linear_velocity = {tip.velocity_m_s[0], tip.velocity_m_s[1], tip.velocity_m_s[2]};
    push(fingers_[i], sample);
  }
}

void TrackingHistory::add_camera(const v1::CameraState& state, Duration to_local) {
  auto found = std::find_if(cameras_.begin(), cameras_.end(),
                            [&state](const Camera& camera) { return camera.camera.index == state.camera(); });
  // Lens and name are told about once a second; between, they are as they were.
  const bool told = state.width_px() != 0;
  if (!told && found == cameras_.end()) return;
  if (told) {
    const std::optional<Pinhole> pinhole = pinhole_of(state);
    if (!pinhole) {
      ++status_.refused;
      return;
    }
    if (found == cameras_.end()) {
      if (cameras_.size() >= max_cameras) return;
      found = cameras_.insert(cameras_.end(), Camera{});
    }
    constexpr std::size_t max_name_bytes = 64;
    found->camera = {state.camera(), state.name().substr(0, max_name_bytes), *pinhole, state.on_head()};
  }
  if (!usable(state.state())) return;
  if (!is_time(state.exposure_time_ns())) {
    ++status_.refused;
    return;
  }
  MeasuredPose sample;
  sample.time = from_ns(state.exposure_time_ns()) + to_local;
  sample.pose = pose_of(state.world_from_camera());
  push(found->poses, sample);
}

std::optional<PoseAnswer> TrackingHistory::camera_at(std::uint32_t index, TimePoint time) const {
  for (const Camera& camera : cameras_) {
    if (camera.camera.index == index) return camera.poses.at(time);
  }
  return std::nullopt;
}

std::array<std::optional<FingerAnswer>, finger_count> TrackingHistory::fingers_at(TimePoint time) const {
  std::array<std::optional<FingerAnswer>, finger_count> out;
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (!usable(finger_states_[i])) continue;
    if (const std::optional<PoseAnswer> answer = fingers_[i].at(time)) {
      out[i] = FingerAnswer{answer->pose.position, finger_states_[i] != v1::TRACKING_PREDICTED};
    }
  }
  return out;
}

}  // namespace handloft::client
