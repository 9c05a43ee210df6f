#include "server-model/interaction/hand_sample.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "common/codec/fingertips.h"

namespace handloft::interaction {
namespace {

Error bad(std::string field, double found, const char* expected) {
  return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected {}", found, expected),
                    std::move(field));
}

bool usable(v1::TrackingState state) {
  return state == v1::TRACKING_TRACKED || state == v1::TRACKING_SINGLE || state == v1::TRACKING_PREDICTED;
}

}  // namespace

Result<std::optional<HandSample>> read_hand(const v1::TrackingFrame& frame, int index,
                                            const SampleLimits& limits) {
  if (index < 0 || index >= frame.hands_size()) return std::optional<HandSample>{};
  const v1::HandState& hand = frame.hands(index);
  const std::string name = fmt::format("hands[{}]", index);
  HandSample sample;
  sample.capture_time = from_ns(frame.capture_time_ns());
  const auto tips = codec::unpack_fingertips(hand);
  if (!tips) {
    Error error = tips.error();
    error.field = fmt::format("{}.{}", name, error.field);
    return error;
  }
  static_assert(codec::fingertip_count == finger_count);
  for (std::size_t i = 0; i < finger_count; ++i) {
    const codec::FingertipRecord& tip = (*tips)[i];
    if (!usable(tip.state)) continue;  // its position must not even be looked at
    const Eigen::Vector3d position(tip.position_m.data());
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(position[axis]) <= limits.max_distance_m)) {
        return bad(fmt::format("{}.fingertip_positions[{}]", name, 3 * i + static_cast<std::size_t>(axis)),
                   position[axis], "a number within reach of the table");
      }
    }
    sample.fingertips[i] = Fingertip{position, tip.state != v1::TRACKING_PREDICTED};
  }
  sample.gesture = hand.gesture();
  // A time before the clock's beginning is none.
  if (const std::int64_t since = std::min(hand.gesture_since_ns(), frame.capture_time_ns()); since > 0) {
    sample.gesture_since = from_ns(since);
  }
  if (!(hand.pressure() >= 0.0 && hand.pressure() <= 1.0))
    return bad(name + ".pressure", hand.pressure(), "0..1");
  sample.pressure = hand.pressure();
  sample.pressing = hand.pressing();
  sample.thumb_laid = (hand.contacts() >> v1::CONTACT_PAD_THUMB & 1U) != 0;
  if (!(hand.potentiometer() >= 0.0 && hand.potentiometer() <= 1.0))
    return bad(name + ".potentiometer", hand.potentiometer(), "0..1");
  sample.potentiometer = hand.potentiometer();
  return std::optional<HandSample>(sample);
}

}  // namespace handloft::interaction
