#pragma once
// Gestures from debounced contact pads (T10). Bits 0..3: index, middle, ring, little finger flexed onto the
// palm; bit 4: thumb; bit 5: the table pad. open: none of 0..3; closed: all four; pointing: middle, ring and
// little without index. Any other combination happens on the way from one to another: it holds the previous
// gesture for a moment, then says unknown.

#include <cstdint>

#include "common/base/clock.h"
#include "daemon-tracking/fusion/contact_debouncer.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {

/// The gesture of a combination, unknown for one that is none.
Gesture gesture_of(std::uint8_t contacts);

class GestureClassifier {
 public:
  explicit GestureClassifier(Duration hold = std::chrono::milliseconds(100)) : hold_(hold) {}

  /// The pads as of `time`. The gesture's start is the latest first edge among the pads that make it.
  void feed(TimePoint time, const ContactDebouncer& contacts);
  /// No glove: unknown from `time` on.
  void clear(TimePoint time);

  Gesture gesture() const { return gesture_; }
  TimePoint since() const { return since_; }

 private:
  Duration hold_;
  Gesture gesture_ = Gesture::unknown;
  TimePoint since_;
  bool undefined_ = false;
  TimePoint undefined_since_;
};

}  // namespace handloft::tracking
