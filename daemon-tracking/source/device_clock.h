#pragma once
// A device's own clock on ours (T4). A report that was sampled at a steady 250 Hz arrives when the USB host
// asks and our thread is woken: a jitter of milliseconds, which the device's own time does not have. This
// unwraps the device's 32-bit microseconds and finds the line
//
//   our time = device time (1 + skew) + offset
//
// under all arrivals: the quickest arrivals of the last seconds were delayed least, so the line goes through
// them (after the lower envelope of Cristian's algorithm). Skew takes up a crystal's or a resonator's error.
// What is left is the constant part of the delay, below a millisecond for full-speed USB.
//
// Pure: the same reports give the same times, so a replay does too (T13).

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/base/clock.h"

namespace handloft::tracking {

struct DeviceClockOptions {
  /// Each of these spans gives its quickest arrival: at 250 Hz one of 250 is near the least delay.
  Duration span = std::chrono::seconds(1);
  double max_skew = 0.01;  ///< A ceramic resonator is within 0.5 %; beyond 1 % no clock is that bad.
  /// Device and arrival may disagree by this much; beyond, the device was restarted or its clock stands
  /// still, and the line begins anew.
  Duration max_delay = std::chrono::milliseconds(100);
};

class DeviceClock {
 public:
  explicit DeviceClock(const DeviceClockOptions& options = {}) : options_(options) {}

  /// The time of a report on our clock: not after its arrival, not before the report before it.
  TimePoint map(std::uint32_t device_us, TimePoint arrival);
  /// The device says that it began anew, or it was away.
  void reset();

  /// How often the line had to begin anew by itself.
  std::uint64_t resets() const { return resets_; }
  double skew() const { return skew_; }

 private:
  static constexpr std::size_t span_count = 8;
  struct Quickest {
    double device_s = 0.0;
    double offset_s = 0.0;  ///< Arrival minus device time, both since the first report
  };

  void begin(std::uint32_t device_us, TimePoint arrival);
  void fit();

  DeviceClockOptions options_;
  bool started_ = false;
  std::uint32_t last_us_ = 0;
  std::int64_t device_us_ = 0;  ///< Unwrapped, since the first report
  TimePoint first_arrival_;
  TimePoint last_mapped_;
  TimePoint last_arrival_;
  std::array<Quickest, span_count> spans_{};  ///< Complete ones, a ring
  std::size_t span_total_ = 0;
  std::optional<Quickest> current_;
  double current_began_s_ = 0.0;
  double skew_ = 0.0;
  double offset_s_ = 0.0;
  std::uint64_t resets_ = 0;
};

}  // namespace handloft::tracking
