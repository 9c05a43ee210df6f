#pragma once
// The distribution of a duration or error over a session: percentiles of up to a fixed number of values,
// evenly thinned when there are more, so that a daemon may run for weeks in bounded memory. Not thread-safe.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace handloft::tracking {

class Percentiles {
 public:
  /// Values that are not finite are not counted.
  void add(double value);
  /// The value below which `fraction` (0..1) of all lie; 0 without values.
  double at(double fraction) const;
  std::uint64_t count() const { return count_; }

 private:
  static constexpr std::size_t capacity =
      1 << 13;  // Reached within five minutes at 30 Hz; 82 lie above the p99.
  std::vector<double> kept_;
  std::uint64_t count_ = 0;
  std::uint64_t stride_ = 1;  // Every stride-th value is kept; doubles when the memory is full.
};

}  // namespace handloft::tracking
