#pragma once
// Time: CLOCK_MONOTONIC nanoseconds of this host, always read through an injectable clock (T4), so that a
// recording can be replayed faster than real time through the very same code.

#include <atomic>
#include <chrono>
#include <cstdint>

namespace handloft {

/// The time line of CLOCK_MONOTONIC. Never the wall clock: that one only stands in file headers.
struct MonotonicTime {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = std::chrono::nanoseconds;
  using time_point = std::chrono::time_point<MonotonicTime>;
  static constexpr bool is_steady = true;
};

using Duration = MonotonicTime::duration;
using TimePoint = MonotonicTime::time_point;

/// Nanoseconds as they stand on the wire and in recordings.
constexpr std::int64_t to_ns(TimePoint time) {
  return time.time_since_epoch().count();
}
constexpr TimePoint from_ns(std::int64_t ns) {
  return TimePoint(Duration(ns));
}

/// Seconds as a double, for the mathematics of motion.
constexpr double to_seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}
constexpr Duration from_seconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

class Clock {
 public:
  virtual ~Clock() = default;
  virtual TimePoint now() const = 0;
};

/// CLOCK_MONOTONIC itself. Thread-safe.
class SystemClock final : public Clock {
 public:
  TimePoint now() const override;
};

/// A clock that stands still until it is told otherwise: for tests and replays. Thread-safe.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(TimePoint start = TimePoint{}) : now_ns_(to_ns(start)) {}
  TimePoint now() const override { return from_ns(now_ns_.load()); }
  void set(TimePoint time) { now_ns_.store(to_ns(time)); }
  void advance(Duration by) { now_ns_.fetch_add(by.count()); }

 private:
  std::atomic<std::int64_t> now_ns_;
};

}  // namespace handloft
