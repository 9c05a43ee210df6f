#pragma once
// The glove's state from its reports (T9, T10): debounced contacts, gesture, calibrated pressure with the raw
// value beside it, "pressing" with hysteresis. A device that goes releases everything.

#include <array>
#include <cstdint>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/fusion/contact_debouncer.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/fusion/gesture_classifier.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

struct GloveOptions {
  DebounceOptions debounce;
  Duration gesture_hold = std::chrono::milliseconds(100);
  double force_zero = 0.0;     ///< Raw force that is no pressure; from calibration (T11).
  double force_full = 1023.0;  ///< Raw force that is full pressure.
  double pressing_on = 0.08;   ///< Hysteresis of `pressing`.
  double pressing_off = 0.05;
  Duration silent_after =
      std::chrono::milliseconds(500);  ///< Without reports for this long: as if unplugged.
};

class GloveTracker {
 public:
  explicit GloveTracker(const GloveOptions& options = {});

  /// One HID report. Errors of the parser leave the state as it was.
  Status consume(const GloveBytes& report);
  void device_gone(TimePoint time);
  /// Lets time pass: pending contacts settle, a silent glove is let go.
  void advance(TimePoint time);

  /// Fills the glove's part of a hand.
  void describe(FusedHand& hand) const;

 private:
  GloveOptions options_;
  ContactDebouncer contacts_;
  GestureClassifier gesture_;
  bool present_ = false;
  TimePoint last_report_;
  std::array<std::uint16_t, 3> forces_{};  ///< For a median of three: single spikes are the converter's
  int force_count_ = 0;
  std::uint16_t raw_force_ = 0;
  double pressure_ = 0.0;
  bool pressing_ = false;
  TimePoint pressing_since_;
  double potentiometer_ = 0.0;
  std::uint16_t raw_potentiometer_ = 0;
  std::uint8_t battery_percent_ = 0;
};

}  // namespace handloft::tracking
