#include "server-model/session/client_frame.h"

#include <algorithm>
#include <utility>

#include "server-model/interaction/interaction.h"
#include "server-model/interaction/space_mouse.h"
#include "server-model/session/presence.h"

namespace handloft::session {
namespace {

/// 73 years: sums and differences of two such times are within 64 bits.
constexpr std::int64_t max_time_ns = std::int64_t{1} << 61U;

bool is_time(std::int64_t ns) {
  return ns > 0 && ns <= max_time_ns;
}

Error in_tracking(Error error) {
  error.field = "tracking." + error.field;
  return error;
}

void copy_hand(const v1::HandState& from, v1::HandState& to) {
  *to.mutable_fingertip_states() = from.fingertip_states();
  *to.mutable_fingertip_positions() = from.fingertip_positions();
  *to.mutable_fingertip_velocities() = from.fingertip_velocities();
  to.set_gesture(from.gesture());
  to.set_pressure(from.pressure());
  to.set_pressing(from.pressing());
  to.set_potentiometer(from.potentiometer());
  to.set_contacts(from.contacts());
  to.set_table_by_contact(from.table_by_contact());
  to.set_table_by_height(from.table_by_height());
  to.set_glove_present(from.glove_present());
  to.set_battery_percent(from.battery_percent());
}

}  // namespace

ClientClock ClientClock::of(const net::PeerInfo& peer) {
  const std::int64_t received = to_ns(peer.hello_received);
  if (!is_time(peer.hello_sent_ns) || !is_time(received)) return {};
  return {Duration(received - peer.hello_sent_ns)};
}

TimePoint ClientClock::to_server(std::int64_t client_ns, TimePoint received, Duration max_age) const {
  if (!is_time(client_ns)) return received;
  const TimePoint time = from_ns(client_ns) + server_minus_client;
  return time > received || time < received - max_age ? received : time;
}

Result<v1::TrackingFrame> read_client_frame(const v1::TrackingFrame& frame, const ClientClock& clock,
                                            TimePoint received, const ClientFrameOptions& options) {
  v1::TrackingFrame result;
  const TimePoint captured = clock.to_server(frame.capture_time_ns(), received, options.max_age);
  result.set_sequence(frame.sequence());
  result.set_capture_time_ns(to_ns(captured));
  const int hands = std::min(frame.hands_size(), static_cast<int>(interaction::Interaction::max_hands));
  for (int i = 0; i < hands; ++i) {
    const auto sample = interaction::read_hand(frame, i, options.limits);
    if (!sample) return in_tracking(sample.error());
    const v1::HandState& from = frame.hands(i);
    v1::HandState& to = *result.add_hands();
    copy_hand(from, to);
    // However old: what the hand does now it may have begun to do long ago.
    if (const std::int64_t since = from.gesture_since_ns();
        is_time(since) && is_time(frame.capture_time_ns())) {
      to.set_gesture_since_ns(to_ns(captured) - std::max<std::int64_t>(0, frame.capture_time_ns() - since));
    }
  }
  if (const auto mouse = interaction::read_space_mouse(frame, {}); !mouse) return in_tracking(mouse.error());
  if (frame.has_space_mouse()) {
    v1::SpaceMouseState& to = *result.mutable_space_mouse();
    *to.mutable_translation() = frame.space_mouse().translation();
    *to.mutable_rotation() = frame.space_mouse().rotation();
    to.set_present(frame.space_mouse().present());
  }
  if (frame.has_head()) {
    v1::Presence presence;
    *presence.mutable_head() = frame.head();
    *result.mutable_head() = std::move(*clean_presence(std::move(presence)).mutable_head());
  }
  result.DiscardUnknownFields();
  return result;
}

}  // namespace handloft::session
