#include "daemon-tracking/fusion/serial_glove_mapper.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace handloft::tracking {

namespace {

constexpr int least_travel_parts = 8;
// By Finger: thumb, index, middle, ring, little.
constexpr std::array<std::uint16_t, finger_count> contact_of{contact_thumb, contact_index, contact_middle,
                                                             contact_ring, contact_little};

std::uint16_t to_analogue(double part) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(part, 0.0, 1.0) * glove_analogue_max));
}

}  // namespace

GloveReport SerialGloveMapper::map(const SerialGloveLine& line) {
  const std::uint16_t largest = std::max<std::uint16_t>(mapping_.largest, 1);
  const auto part = [&](std::uint16_t value) { return std::min(1.0, static_cast<double>(value) / largest); };
  GloveReport out;
  for (std::size_t i = 0; i < fingers_.size(); ++i) {
    Finger& finger = fingers_[i];
    if (const auto& value = line.curl[i]) {
      const std::uint16_t curl = std::min(*value, largest);
      finger.low = finger.seen ? std::min(finger.low, curl) : curl;
      finger.high = finger.seen ? std::max(finger.high, curl) : curl;
      finger.seen = true;
      const int travel = finger.high - finger.low;
      if (travel >= largest / least_travel_parts && travel > 0) {
        finger.curl = static_cast<double>(curl - finger.low) / travel;
        finger.flexed = finger.curl > (finger.flexed ? mapping_.flexed_off : mapping_.flexed_on);
      }
    }
    if (finger.flexed) out.contacts = static_cast<std::uint16_t>(out.contacts | contact_of[i]);
  }
  if ((line.buttons & mapping_.table_button) != 0)
    out.contacts = static_cast<std::uint16_t>(out.contacts | contact_table);
  if (line.trigger) trigger_ = part(*line.trigger);
  if (line.joystick_y) joystick_y_ = part(*line.joystick_y);
  if (mapping_.pressure == SerialPressure::index_curl) {
    out.force = to_analogue(fingers_[static_cast<std::size_t>(handloft::tracking::Finger::index)].curl);
  } else {
    out.force = to_analogue((line.buttons & serial_pinch) != 0 ? 1.0 : trigger_);
  }
  out.potentiometer = to_analogue(joystick_y_);
  return out;
}

}  // namespace handloft::tracking
