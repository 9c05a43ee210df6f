#include "daemon-tracking/source/camera/v4l2_timestamps.h"

#include <algorithm>

namespace handloft::tracking {

namespace {

// A twentieth of each new latency: half a second at 30 Hz settles it, one late frame hardly moves it.
constexpr std::int64_t latency_memory = 20;
constexpr Duration least_step = std::chrono::microseconds(1);

}  // namespace

std::optional<Duration> FrameStamper::trusted_age(const DriverStamp& driver, TimePoint arrival) {
  // A driver that leaves the stamp out leaves 0; what is far from now can't be subtracted safely either.
  if (!driver.monotonic || driver.ns <= 0) return std::nullopt;
  const std::int64_t now_ns = to_ns(arrival);
  if (driver.ns > now_ns + options_.furthest_ahead.count() || driver.ns < now_ns - options_.oldest.count())
    return std::nullopt;
  if (last_driver_ns_ && driver.ns <= *last_driver_ns_) return std::nullopt;
  return Duration(now_ns - driver.ns);
}

FrameStamp FrameStamper::stamp(const DriverStamp& driver, TimePoint arrival, Duration exposure) {
  FrameStamp result;
  const std::optional<Duration> age = trusted_age(driver, arrival);
  Duration latency{};
  if (age) {
    last_driver_ns_ = driver.ns;
    ahead_ = std::max(ahead_, -*age);
    const Duration to_middle =
        driver.point == StampPoint::start_of_exposure ? exposure / 2 : -(options_.readout + exposure / 2);
    latency = *age + ahead_ - to_middle;
    latency_ = latency_ ? *latency_ + (latency - *latency_) / latency_memory : latency;
  } else {
    result.estimated = true;
    latency = latency_.value_or(options_.frame_interval + exposure / 2);
  }
  result.capture = arrival - latency + options_.offset;
  if (last_capture_ && result.capture <= *last_capture_) result.capture = *last_capture_ + least_step;
  last_capture_ = result.capture;
  return result;
}

}  // namespace handloft::tracking
