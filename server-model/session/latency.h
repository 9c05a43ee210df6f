#pragma once
// How long something took, over many times, in bounded memory: counts in logarithmic bins.

#include <array>
#include <cstdint>

#include "common/base/clock.h"

namespace handloft::session {

struct LatencySummary {
  std::uint64_t count = 0;
  double median_ms = 0.0;  ///< To within a bin, 5 %.
  double p99_ms = 0.0;
  double max_ms = 0.0;  ///< Exact.
};

/// Not thread-safe.
class LatencyHistogram {
 public:
  /// Negative durations (a clock of another host) count as zero.
  void add(Duration duration);
  LatencySummary summary() const;

 private:
  static constexpr std::size_t bin_count = 400;  ///< From 1 us in steps of 5 % up to five minutes.
  std::array<std::uint64_t, bin_count> bins_{};
  std::uint64_t count_ = 0;
  Duration max_{};
};

}  // namespace handloft::session
