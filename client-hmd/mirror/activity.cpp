#include "client-hmd/mirror/activity.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "client-hmd/mirror/read_curve.h"
#include "common/codec/fingertips.h"

namespace handloft::client {
namespace {

Error corrupt(std::string field, std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message), std::move(field));
}

Result<Vec3f> read_place(const v1::Vec3& v, const char* field, const ActivityLimits& limits) {
  for (const double value : {v.x(), v.y(), v.z()}) {
    if (!std::isfinite(value) || std::abs(value) > limits.max_coordinate_m) {
      return corrupt(field, fmt::format("expected a place within {} m", limits.max_coordinate_m));
    }
  }
  return Vec3f{static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

Result<Vec3f> read_direction(const v1::Vec3& v, const char* field) {
  const double length = std::hypot(v.x(), v.y(), v.z());
  constexpr double shortest = 1e-9;
  if (!std::isfinite(length) || length < shortest) {
    return corrupt(field, "found no direction, expected a vector that can be normalised");
  }
  return Vec3f{static_cast<float>(v.x() / length), static_cast<float>(v.y() / length),
               static_cast<float>(v.z() / length)};
}

Result<DiskMark> read_disk(const v1::DiskPose& pose, const ActivityLimits& limits) {
  const Result<Vec3f> centre = read_place(pose.centre(), "disk.centre", limits);
  if (!centre) return centre.error();
  const Result<Vec3f> normal = read_direction(pose.normal(), "disk.normal");
  if (!normal) return normal.error();
  if (!(pose.radius_m() >= 0.0 && pose.radius_m() <= limits.max_disk_radius_m)) {
    return corrupt("disk.radius_m",
                   fmt::format("found {}, expected 0..{}", pose.radius_m(), limits.max_disk_radius_m));
  }
  return DiskMark{*centre, *normal, static_cast<float>(pose.radius_m())};
}

bool usable(v1::TrackingState state) {
  return state == v1::TRACKING_TRACKED || state == v1::TRACKING_SINGLE || state == v1::TRACKING_PREDICTED;
}

HandPosture posture_of(v1::Gesture gesture) {
  switch (gesture) {
    case v1::GESTURE_CLOSED:
      return HandPosture::closed;
    case v1::GESTURE_POINTING:
      return HandPosture::pointing;
    case v1::GESTURE_ON_TABLE:
      return HandPosture::on_table;
    default:
      return HandPosture::open;
  }
}

/// A vector whose parts are within `limit`; errors name `field`.
template <typename Numbers>
Result<Vec3f> read_numbers(const Numbers& v, double limit, const char* field) {
  for (const auto value : v) {
    const double number = static_cast<double>(value);
    if (!std::isfinite(number) || std::abs(number) > limit) {
      return corrupt(field, fmt::format("expected numbers within {}", limit));
    }
  }
  return Vec3f{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

/// nullopt: nothing of it is known.
Result<std::optional<HandMark>> read_hand(const v1::HandState& hand, const ActivityLimits& limits) {
  static_assert(codec::fingertip_count == tips_of_a_hand);
  const auto tips = codec::unpack_fingertips(hand);
  if (!tips) return make_error(tips.error().code, tips.error().message, "hand." + tips.error().field);
  if (!(hand.pressure() >= 0.0 && hand.pressure() <= 1.0)) {
    return corrupt("hand.pressure", fmt::format("found {}, expected 0..1", hand.pressure()));
  }
  HandMark mark;
  mark.posture = posture_of(hand.gesture());
  mark.pressure = static_cast<float>(hand.pressure());
  mark.pressing = hand.pressing();
  bool any = false;
  for (std::size_t i = 0; i < tips_of_a_hand; ++i) {
    const codec::FingertipRecord& tip = (*tips)[i];
    if (!usable(tip.state)) continue;
    const Result<Vec3f> place =
        read_numbers(tip.position_m, limits.max_coordinate_m, "hand.fingertip_positions");
    if (!place) return place.error();
    const Result<Vec3f> velocity =
        read_numbers(tip.velocity_m_s, limits.max_speed_m_s, "hand.fingertip_velocities");
    if (!velocity) return velocity.error();
    mark.tips[i] = {tip.state == v1::TRACKING_PREDICTED ? TipState::predicted : TipState::seen, *place,
                    *velocity};
    any = true;
  }
  return any ? std::optional(mark) : std::nullopt;
}

Result<std::optional<HeadMark>> read_head(const v1::HeadState& head, const ActivityLimits& limits) {
  if (!usable(head.state())) return std::optional<HeadMark>();
  const auto vector_of = [](const v1::Vec3& v) { return std::array{v.x(), v.y(), v.z()}; };
  HeadMark mark;
  const Result<Vec3f> place = read_place(head.world_from_head().position(), "head.position", limits);
  if (!place) return place.error();
  mark.place = *place;
  const v1::Quaternion& q = head.world_from_head().orientation();
  const double length = std::hypot(std::hypot(q.w(), q.x()), std::hypot(q.y(), q.z()));
  constexpr double shortest = 1e-9;
  if (!std::isfinite(length) || length < shortest) {
    return corrupt("head.orientation", "expected a quaternion that can be normalised");
  }
  mark.orientation = {static_cast<float>(q.w() / length), static_cast<float>(q.x() / length),
                      static_cast<float>(q.y() / length), static_cast<float>(q.z() / length)};
  const Result<Vec3f> velocity =
      read_numbers(vector_of(head.linear_velocity()), limits.max_speed_m_s, "head.linear_velocity");
  if (!velocity) return velocity.error();
  mark.velocity = *velocity;
  const Result<Vec3f> turn =
      read_numbers(vector_of(head.angular_velocity()), limits.max_turn_rad_s, "head.angular_velocity");
  if (!turn) return turn.error();
  mark.angular_velocity = *turn;
  return std::optional(mark);
}

Result<PlaneMark> read_plane(const v1::Plane& plane, const ActivityLimits& limits) {
  const Result<Vec3f> origin = read_place(plane.origin(), "symmetry_plane.origin", limits);
  if (!origin) return origin.error();
  const Result<Vec3f> normal = read_direction(plane.normal(), "symmetry_plane.normal");
  if (!normal) return normal.error();
  return PlaneMark{*origin, *normal};
}

}  // namespace

Result<Activity> read_activity(const v1::Presence& presence, const ActivityLimits& limits) {
  const auto shortened = [&limits](const std::string& text) { return text.substr(0, limits.max_text_bytes); };
  Activity activity;
  activity.client_id = presence.client_id();
  activity.name = shortened(presence.name());
  activity.tool = shortened(presence.tool());
  activity.entity = shortened(presence.entity());
  activity.mode = shortened(presence.mode());
  activity.symmetry = presence.symmetry();
  activity.smooth_falloff = presence.falloff() == v1::FALLOFF_SMOOTH;
  activity.palette_page = presence.palette_page();
  if (presence.has_symmetry_plane()) {
    const Result<PlaneMark> plane = read_plane(presence.symmetry_plane(), limits);
    if (!plane) return plane.error();
    activity.symmetry_plane = *plane;
  }
  if (presence.has_disk()) {
    const Result<DiskMark> disk = read_disk(presence.disk(), limits);
    if (!disk) return disk.error();
    activity.disk = *disk;
  }
  if (!(presence.range() >= 0.0 && presence.range() <= 1.0)) {
    return corrupt("range", fmt::format("found {}, expected 0..1", presence.range()));
  }
  activity.range = static_cast<float>(presence.range());
  if (presence.has_curve()) {
    Result<SceneCurve> curve =
        read_curve(presence.curve(), {limits.max_curve_points, limits.max_coordinate_m});
    if (!curve) return make_error(curve.error().code, curve.error().message, "curve." + curve.error().field);
    activity.curve = std::make_shared<const SceneCurve>(std::move(*curve));
  }
  if (presence.has_hand()) {
    const Result<std::optional<HandMark>> hand = read_hand(presence.hand(), limits);
    if (!hand) return hand.error();
    activity.hand = *hand;
  }
  if (presence.has_head()) {
    const Result<std::optional<HeadMark>> head = read_head(presence.head(), limits);
    if (!head) return head.error();
    activity.head = *head;
  }
  return activity;
}

}  // namespace handloft::client
