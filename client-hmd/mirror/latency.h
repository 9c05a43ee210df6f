#pragma once
// Distribution of a duration: a fixed array of counts, so that a week of samples costs no memory and adding
// one costs no time (T15). Bins of a quarter millisecond up to two seconds; what is longer counts in the last
// one.

#include <array>
#include <cstdint>

#include "common/base/clock.h"

namespace handloft::client {

class LatencyHistogram {
 public:
  /// Negative durations (clocks that disagree) count as zero.
  void add(Duration duration);
  std::uint64_t count() const { return count_; }
  /// The smallest duration that `share` (0..1) of the samples do not exceed, in milliseconds to a quarter; 0
  /// when empty.
  double quantile_ms(double share) const;
  /// Of the longest one, exactly; 0 when empty.
  double longest_ms() const { return std::chrono::duration<double, std::milli>(longest_).count(); }

 private:
  static constexpr std::size_t bins_per_ms = 4;
  std::array<std::uint64_t, 2000 * bins_per_ms> bins_{};
  std::uint64_t count_ = 0;
  Duration longest_{};
};

}  // namespace handloft::client
