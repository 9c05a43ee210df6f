#pragma once
// The glove's state from its reports (T9, T10): debounced contacts, gesture, calibrated pressure with the raw
// value beside it, "pressing" with hysteresis. Reports count at the device's own time, put on our clock, not
// at their arrival (T4). A device that goes releases everything.

#include <array>
#include <cstdint>
#include <optional>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/fusion/contact_debouncer.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/fusion/gesture_classifier.h"
#include "daemon-tracking/fusion/serial_glove_mapper.h"
#include "daemon-tracking/source/device_clock.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

/// Whose range turns raw values into 0..1.
enum class GloveRangeFrom : std::uint8_t {
  device_first,  ///< The one that the glove keeps, if it was calibrated; else that of the options.
  options,
};

struct GloveOptions {
  DebounceOptions debounce;
  Duration gesture_hold = std::chrono::milliseconds(100);
  double force_zero = 0.0;         ///< Raw force that is no pressure; from calibration (T11).
  double force_full = 1023.0;      ///< Raw force that is full pressure.
  double potentiometer_low = 0.0;  ///< Raw values of the potentiometer's ends.
  double potentiometer_high = 1023.0;
  GloveRangeFrom range_from = GloveRangeFrom::device_first;
  DeviceClockOptions clock;
  SerialGloveMapping serial;
  double pressing_on = 0.08;  ///< Hysteresis of `pressing`.
  double pressing_off = 0.05;
  Duration silent_after =
      std::chrono::milliseconds(500);  ///< Without reports for this long: as if unplugged.
};

/// Counted since the start.
struct GloveCounters {
  std::uint64_t reports = 0;       ///< Used
  std::uint64_t refused = 0;       ///< By the parser: checksum, length, a value out of range
  std::uint64_t lost = 0;          ///< Missing by the sequence
  std::uint64_t bounces = 0;       ///< Edges of contacts that came to nothing: wear
  std::uint64_t clock_resets = 0;  ///< The device's time jumped
};

class GloveTracker {
 public:
  explicit GloveTracker(const GloveOptions& options = {});

  /// One HID report: state, or the range that the glove keeps. Errors of the parser leave the state as it
  /// was.
  Status consume(const GloveBytes& report);
  /// One line of a serial glove. Errors as above.
  Status consume(const DeviceBytes& line);
  void device_gone(TimePoint time);
  /// Lets time pass: pending contacts settle, a silent glove is let go.
  void advance(TimePoint time);

  /// Fills the glove's part of a hand.
  void describe(FusedHand& hand) const;
  GloveCounters counters() const;
  /// What turns raw values into 0..1 now.
  GloveRange range() const;

 private:
  void use(const GloveReport& report, TimePoint time);
  void let_go(TimePoint time);
  void count_lost(const GloveReport& report);

  GloveOptions options_;
  DeviceClock clock_;
  SerialGloveMapper serial_;
  GloveCounters counters_;
  std::optional<GloveRange> device_range_;
  std::optional<std::uint16_t> sequence_;
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
