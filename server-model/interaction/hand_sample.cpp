#include "server-model/interaction/hand_sample.h"

#include <fmt/core.h>

#include <cmath>
#include <string>

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
  for (int i = 0; i < hand.fingertips_size(); ++i) {
    const v1::FingertipState& tip = hand.fingertips(i);
    if (!usable(tip.state())) continue;  // its position must not even be looked at
    const std::string tip_name = fmt::format("{}.fingertips[{}]", name, i);
    const auto finger = static_cast<std::size_t>(tip.finger());
    if (tip.finger() < 0 || finger >= finger_count) {
      return bad(tip_name + ".finger", static_cast<double>(tip.finger()), "0..4");
    }
    if (sample.fingertips[finger])
      return bad(tip_name + ".finger", static_cast<double>(tip.finger()), "each finger once");
    const Eigen::Vector3d position(tip.position().x(), tip.position().y(), tip.position().z());
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(position[axis]) <= limits.max_distance_m)) {
        return bad(fmt::format("{}.position.{}", tip_name, "xyz"[axis]), position[axis],
                   "a number within reach of the table");
      }
    }
    sample.fingertips[finger] = Fingertip{position, tip.state() != v1::TRACKING_PREDICTED};
  }
  sample.gesture = hand.gesture();
  if (!(hand.pressure() >= 0.0 && hand.pressure() <= 1.0))
    return bad(name + ".pressure", hand.pressure(), "0..1");
  sample.pressure = hand.pressure();
  sample.pressing = hand.pressing();
  return std::optional<HandSample>(sample);
}

}  // namespace handloft::interaction
