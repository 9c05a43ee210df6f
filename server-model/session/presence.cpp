#include "server-model/session/presence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "common/codec/fingertips.h"

namespace handloft::session {
namespace {

constexpr std::size_t max_text_bytes = 256;

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
  return presence;
}

}  // namespace handloft::session
