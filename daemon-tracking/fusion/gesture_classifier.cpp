#include "daemon-tracking/fusion/gesture_classifier.h"

#include <algorithm>

namespace handloft::tracking {

namespace {
constexpr unsigned finger_pads = contact_index | contact_middle | contact_ring | contact_little;
constexpr int first_finger_pad = 0;
constexpr int last_finger_pad = 3;
}  // namespace

Gesture gesture_of(std::uint8_t contacts) {
  switch (contacts & finger_pads) {
    case 0:
      return Gesture::open;
    case finger_pads:
      return Gesture::closed;
    case contact_middle | contact_ring | contact_little:
      return Gesture::pointing;
    default:
      return Gesture::unknown;
  }
}

void GestureClassifier::feed(TimePoint time, const ContactDebouncer& contacts) {
  const Gesture now = gesture_of(contacts.bits());
  TimePoint edge{};
  for (int pad = first_finger_pad; pad <= last_finger_pad; ++pad)
    edge = std::max(edge, contacts.changed(pad));
  if (now == Gesture::unknown) {
    if (!undefined_) undefined_since_ = edge == TimePoint{} ? time : edge;
    undefined_ = true;
    if (gesture_ != Gesture::unknown && time - undefined_since_ > hold_) {
      gesture_ = Gesture::unknown;
      since_ = undefined_since_;
    }
    return;
  }
  undefined_ = false;
  if (now == gesture_) return;
  gesture_ = now;
  since_ = edge == TimePoint{} ? time : edge;
}

void GestureClassifier::clear(TimePoint time) {
  if (gesture_ != Gesture::unknown) since_ = time;
  gesture_ = Gesture::unknown;
  undefined_ = false;
}

}  // namespace handloft::tracking
