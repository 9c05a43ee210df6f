#pragma once
// How old frames were when they were published (T15), over the last ten seconds, and as a histogram since the
// start. Not thread-safe.

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "common/base/clock.h"

namespace handloft::tracking {

struct LatencyPercentiles {
  std::uint64_t frames = 0;
  double p50_ms = 0.0;
  double p95_ms = 0.0;
  double p99_ms = 0.0;
};

/// Counts of values up to a bound, as Prometheus has them: each includes the one before; the last is all.
struct LatencyHistogram {
  static constexpr std::array<double, 12> bounds_ms{1, 2, 4, 6, 8, 12, 16, 24, 32, 48, 64, 128};
  std::array<std::uint64_t, bounds_ms.size() + 1> up_to{};
  double sum_ms = 0.0;

  void add(double value_ms);
  std::uint64_t count() const { return up_to.back(); }
};

class LatencyWindow {
 public:
  explicit LatencyWindow(Duration length = std::chrono::seconds(10)) : length_(length) {}
  /// Values that are not finite are left out.
  void add(TimePoint now, double value_ms);
  /// Of what came within the window before `now`.
  LatencyPercentiles at(TimePoint now);
  const LatencyHistogram& histogram() const { return histogram_; }

 private:
  struct Value {
    TimePoint time;
    double ms = 0.0;
  };
  static constexpr std::size_t capacity = 8192;  // Six cameras at 120 fps for ten seconds; beyond it, newest.
  void forget(TimePoint now);

  Duration length_;
  std::deque<Value> values_;
  LatencyHistogram histogram_;
};

}  // namespace handloft::tracking
