#pragma once
// Contact pads bounce. Each pad is debounced by time, slower to release than to press (T9): a contact counts
// once it has been stable for `press`, an opening once stable for `release`; the event carries the time of
// its first edge, so that a stroke starts where the finger was. Driven by reports and by time alone, so that
// a silent device still releases. Pure.

#include <array>
#include <cstdint>

#include "common/base/clock.h"

namespace handloft::tracking {

inline constexpr int contact_count = 8;

struct DebounceOptions {
  Duration press = std::chrono::milliseconds(10);    ///< Within 8..15 ms: dome and foil pads settle in 5.
  Duration release = std::chrono::milliseconds(25);  ///< Within 20..30 ms: a moving finger lifts for some ms.
};

class ContactDebouncer {
 public:
  explicit ContactDebouncer(const DebounceOptions& options = {}) : options_(options) {}

  /// The pads' raw bits as of `time`. Time that runs backwards is taken as the newest time.
  void feed(TimePoint time, std::uint8_t raw_bits);
  /// Lets time pass without a report.
  void advance(TimePoint time);
  /// The device has gone: every contact opens at `time`, at once.
  void release_all(TimePoint time);

  std::uint8_t bits() const { return bits_; }
  /// When the pad's debounced state last changed: the first edge, not when it was believed.
  TimePoint changed(int pad) const { return pads_[static_cast<std::size_t>(pad)].changed; }
  /// Edges that came to nothing: a measure of wear.
  std::uint64_t bounces() const { return bounces_; }

 private:
  struct Pad {
    bool raw = false;
    bool pending = false;    ///< raw differs from the debounced state
    bool edge_seen = false;  ///< first_edge is valid
    TimePoint first_edge;    ///< Of the run of edges that led to here
    TimePoint stable_since;
    TimePoint changed;
  };
  DebounceOptions options_;
  std::array<Pad, contact_count> pads_;
  std::uint8_t bits_ = 0;
  TimePoint now_;
  bool started_ = false;
  std::uint64_t bounces_ = 0;
};

}  // namespace handloft::tracking
