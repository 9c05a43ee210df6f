#include "server-model/session/presence.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "common/codec/fingertips.h"

namespace handloft::session {
namespace {

constexpr std::size_t max_text_bytes = 256;
/// A stroke of half a minute; a viewer cannot tell more of them apart.
constexpr std::size_t max_curve_points = 1024;
constexpr int max_selection = 64;
constexpr std::size_t curve_point_bytes = 3 * sizeof(float);
static_assert(std::endian::native == std::endian::little, "Polyline.points are little-endian");

bool finite(const v1::Vec3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

bool finite(const v1::Quaternion& q) {
  return std::isfinite(q.w()) && std::isfinite(q.x()) && std::isfinite(q.y()) && std::isfinite(q.z());
}

/// Cuts at the start of a character, so that UTF-8 stays valid.
void shorten(std::string& text) {
  if (text.size() <= max_text_bytes) return;
  constexpr unsigned continuation_mask = 0xC0;
  constexpr unsigned continuation = 0x80;
  std::size_t end = max_text_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & continuation_mask) == continuation) --end;
  text.resize(end);
}

void clean_hand(v1::HandState& hand) {
  auto tips = codec::unpack_fingertips(hand);
  if (!tips) tips = codec::Fingertips{};
  for (codec::FingertipRecord& tip : *tips) {
    const bool good = std::ranges::all_of(tip.position_m, [](double v) { return std::isfinite(v); }) &&
                      std::ranges::all_of(tip.velocity_m_s, [](float v) { return std::isfinite(v); });
    if (!good) tip.state = v1::TRACKING_LOST;
  }
  codec::pack_fingertips(*tips, hand);
  hand.clear_fingertip_covariances();
  if (!std::isfinite(hand.pressure())) hand.set_pressure(0.0);
  if (!std::isfinite(hand.potentiometer())) hand.set_potentiometer(0.0);
}

bool finite(const v1::DiskPose& disk) {
  return finite(disk.centre()) && finite(disk.normal()) && std::isfinite(disk.radius_m());
}

bool finite(const v1::Plane& plane) {
  return finite(plane.origin()) && finite(plane.normal());
}

/// Whole points of finite coordinates, not too many.
bool good_curve(const std::string& points) {
  if (points.size() % curve_point_bytes != 0 || points.size() > max_curve_points * curve_point_bytes)
    return false;
  for (std::size_t at = 0; at < points.size(); at += sizeof(float)) {
    float value = 0;
    std::memcpy(&value, points.data() + at, sizeof(value));
    if (!std::isfinite(value)) return false;
  }
  return true;
}

void clean_head(v1::HeadState& head) {
  head.clear_covariance();
  const bool good = finite(head.world_from_head().position()) &&
                    finite(head.world_from_head().orientation()) && finite(head.linear_velocity()) &&
                    finite(head.angular_velocity()) && std::isfinite(head.reprojection_rms_px());
  if (good) return;
  head.Clear();
  head.set_state(v1::TRACKING_LOST);
}

}  // namespace

v1::Presence clean_presence(v1::Presence presence) {
  shorten(*presence.mutable_name());
  shorten(*presence.mutable_tool());
  shorten(*presence.mutable_entity());
  if (presence.has_hand()) clean_hand(*presence.mutable_hand());
  if (presence.has_head()) clean_head(*presence.mutable_head());
  shorten(*presence.mutable_mode());
  if (presence.selection_size() > max_selection) {
    presence.mutable_selection()->DeleteSubrange(max_selection, presence.selection_size() - max_selection);
  }
  for (std::string& id : *presence.mutable_selection()) shorten(id);
  if (!finite(presence.disk())) presence.clear_disk();
  if (!finite(presence.symmetry_plane())) presence.clear_symmetry_plane();
  if (!std::isfinite(presence.range())) presence.clear_range();
  if (!good_curve(presence.curve().points())) presence.clear_curve();
  return presence;
}

namespace {

void set_vec3(v1::Vec3& to, const Eigen::Vector3d& from) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

/// Every n-th point and the last, so that they are few enough.
std::string pack_curve(const std::vector<Eigen::Vector3d>& curve) {
  const std::size_t step = curve.size() / max_curve_points + 1;
  std::string packed;
  const auto add = [&](const Eigen::Vector3d& point) {
    const Eigen::Vector3f value = point.cast<float>();
    packed.append(reinterpret_cast<const char*>(value.data()), curve_point_bytes);
  };
  for (std::size_t i = 0; i + 1 < curve.size(); i += step) add(curve[i]);
  if (!curve.empty()) add(curve.back());
  return packed;
}

std::string mode_words(const interaction::Interaction& interaction) {
  const interaction::Modes& modes = interaction.modes();
  if (modes.tool == interaction::HandTool::move) return "move";
  if (std::string words = interaction.sculpting_words(); !words.empty()) return words;
  return modes.trim == interaction::TrimMode::profile ? "profile" : "boundary";
}

}  // namespace

std::string hand_name(const HandOwner& owner, int hand) {
  if (hand == 0) return owner.name;
  const std::string number = std::to_string(hand + 1);
  return owner.client_id == 0 ? owner.name + " " + number : owner.name + " (" + number + ")";
}

v1::Presence hand_presence(const v1::TrackingFrame& frame, int hand,
                           const interaction::Interaction& interaction, const HandOwner& owner) {
  v1::Presence presence;
  presence.set_client_id(owner.client_id);
  presence.set_name(hand_name(owner, hand));
  if (hand < frame.hands_size()) {
    *presence.mutable_hand() = frame.hands(hand);
    presence.set_range(frame.hands(hand).potentiometer());
  }
  if (frame.has_head()) *presence.mutable_head() = frame.head();
  const interaction::HandActivity activity = interaction.activity(static_cast<std::size_t>(hand));
  presence.set_tool(activity.tool);
  const bool own = owner.client_id != 0;
  presence.set_entity(own && activity.entity.empty() ? interaction.active_shape() : activity.entity);
  for (std::string& id : interaction.selection()) presence.add_selection(std::move(id));
  if (!presence.entity().empty() && interaction.selection() != std::vector<std::string>{presence.entity()}) {
    presence.add_selection(presence.entity());
  }
  presence.set_capture_time_ns(frame.capture_time_ns());
  if (activity.disk) {
    set_vec3(*presence.mutable_disk()->mutable_centre(), activity.disk->centre);
    set_vec3(*presence.mutable_disk()->mutable_normal(), activity.disk->normal);
    presence.mutable_disk()->set_radius_m(activity.disk->radius_m);
    presence.mutable_disk()->set_time_ns(frame.capture_time_ns());
  }
  const interaction::Modes& modes = interaction.modes();
  presence.set_mode(mode_words(interaction));
  presence.set_falloff(modes.falloff);
  presence.set_palette_page(static_cast<std::uint32_t>(modes.palette_page));
  if (!activity.curve.empty()) {
    presence.mutable_curve()->set_points(pack_curve(activity.curve));
    presence.mutable_curve()->set_kind(modes.trim == interaction::TrimMode::profile ? v1::Polyline::PROFILE
                                                                                    : v1::Polyline::BOUNDARY);
  }
  if (modes.symmetry != interaction::StrokeSymmetry::off) {
    presence.set_symmetry(true);
    set_vec3(*presence.mutable_symmetry_plane()->mutable_origin(), interaction.symmetry_plane().origin);
    set_vec3(*presence.mutable_symmetry_plane()->mutable_normal(), interaction.symmetry_plane().normal);
  }
  return clean_presence(std::move(presence));
}

v1::GloveFeedback glove_feedback(interaction::Pulse pulse) {
  struct Figures {
    double strength;
    std::uint32_t duration_ms;
  };
  constexpr Figures picked{0.3, 30}, released{0.2, 20}, refused{0.5, 60};
  const Figures& figures = pulse == interaction::Pulse::picked     ? picked
                           : pulse == interaction::Pulse::released ? released
                                                                   : refused;
  v1::GloveFeedback feedback;
  feedback.set_vibration(figures.strength);
  feedback.set_vibration_ms(figures.duration_ms);
  return feedback;
}

}  // namespace handloft::session
