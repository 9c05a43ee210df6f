#pragma once
// When a frame is begun, when its head is asked for, and when it will be seen: as late as the refresh that it
// is meant for allows (V1). Drawing times are measured, a margin is kept, and it grows while refreshes are
// missed. Knows nothing of graphics and never waits itself.
//
//   begin ---- draw the scene ---- latch - present - margin - refresh (swap) ---- half a period ---- light
//
// The refresh is taken from when swaps return, the light from the display's period: its middle line lights up
// half a period later. What a panel needs beyond that is not known here.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/base/clock.h"

namespace handloft::client {

struct FramePacerOptions {
  Duration smallest_margin = std::chrono::microseconds(1500);  ///< What a scheduler may be late by.
  double margin_growth = 1.5;       ///< At a missed refresh; at most to half a period.
  double margin_decay = 1.0 / 128;  ///< Of what is above the smallest, a frame in time: a second or two.
};

struct FramePlan {
  TimePoint begin;    ///< Input is read and the scene drawn from here; not before now.
  TimePoint latch;    ///< The head is asked for and the picture presented.
  TimePoint refresh;  ///< Of the display, at which it is meant to appear.
  TimePoint light;    ///< Its middle line.
};

class FramePacer {
 public:
  explicit FramePacer(const FramePacerOptions& options = {})
      : options_(options), margin_(options.smallest_margin) {}

  /// None: nothing refreshes, plans begin at once, and `light` comes after as long as the last frame took,
  /// but at least `unpaced_latency` later.
  void set_period(std::optional<Duration> period);
  void set_unpaced_latency(Duration latency) { unpaced_latency_ = latency; }

  FramePlan plan(TimePoint now) const;
  /// How long the two parts of a frame took; nonsense (negative, over a second) is passed over.
  void drew(Duration scene, Duration last_pass);
  /// The swap of the frame that `plan` was for returned at `time`. True: it missed its refresh.
  bool swapped(const FramePlan& plan, TimePoint time);

  std::uint64_t missed() const { return missed_; }
  Duration margin() const { return margin_; }

 private:
  /// The longest of the last ones: a pacer that counts on the median is late every other time.
  class Longest {
   public:
    void add(Duration duration);
    Duration get() const;
    Duration last() const { return durations_[(next_ + window - 1) % window]; }

   private:
    static constexpr std::size_t window = 32;
    std::array<Duration, window> durations_{};
    std::size_t next_ = 0;
  };

  FramePacerOptions options_;
  std::optional<Duration> period_;
  Duration unpaced_latency_ = std::chrono::milliseconds(16);
  Duration margin_;
  Longest scene_;
  Longest last_pass_;
  std::optional<TimePoint> last_swap_;
  std::uint64_t missed_ = 0;
};

}  // namespace handloft::client
