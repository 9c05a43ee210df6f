#pragma once
// How long something took, over many times, as a Prometheus histogram: counts below fixed bounds. Thread-safe
// without locks; what is read while others add may be one behind.

#include <array>
#include <atomic>
#include <cstdint>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/metrics_text.h"

namespace handloft {

class Histogram {
 public:
  /// From a tenth of a millisecond, which is a flush on a good disk, to ten seconds. Negative durations (a
  /// clock of another host) count as zero.
  static constexpr std::array<double, 16> bounds_s{0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.02,
                                                   0.05,   0.1,     0.25,   0.5,   1.0,    2.5,   5.0,  10.0};

  void add(Duration duration);
  std::uint64_t count() const { return count_.load(std::memory_order_relaxed); }
  /// The samples of a family of type "histogram" that has begun; `labels` without braces.
  void write(MetricsText& text, std::string_view labels = {}) const;

 private:
  std::array<std::atomic<std::uint64_t>, bounds_s.size() + 1> bins_{};
  std::atomic<std::uint64_t> count_ = 0;
  std::atomic<std::int64_t> sum_ns_ = 0;
};

}  // namespace handloft
