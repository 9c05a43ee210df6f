// T4: a device's clock on ours, without the jitter of arrival.

#include "daemon-tracking/source/device_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace handloft::tracking {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr TimePoint start = from_ns(90'000'000'000);

/// Delays of 0.4 ms and an exponential tail of 1 ms, sometimes 20 ms: a busy USB host.
class Delays {
 public:
  double next_s() {
    const double u = next();
    const double tail = -1e-3 * std::log(1.0 - u);
    return 0.0004 + std::min(tail, 0.008) + (next() < 0.01 ? 0.02 : 0.0);
  }

 private:
  double next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state_ >> 11) / 9007199254740992.0;
  }
  std::uint64_t state_ = 42;
};

struct Errors {
  double rms_s = 0.0, worst_s = 0.0, arrival_rms_s = 0.0;
};

/// Reports at 250 Hz by a device whose seconds last 1 + skew of ours; errors after the first ten seconds,
/// without the constant part of the delay.
Errors run(double skew, double until_s, std::uint32_t first_us) {
  DeviceClock clock;
  Delays delays;
  Errors out;
  double count = 0;
  TimePoint last{}, last_arrival{};
  for (double device_s = 0.0; device_s < until_s; device_s += 0.004) {
    const TimePoint sampled = start + from_seconds(device_s * (1.0 + skew));
    const TimePoint arrival = std::max(last_arrival, sampled + from_seconds(delays.next_s()));
    last_arrival = arrival;
    const auto device_us = first_us + static_cast<std::uint32_t>(std::llround(device_s * 1e6));
    const TimePoint mapped = clock.map(device_us, arrival);
    EXPECT_LE(mapped, arrival);
    EXPECT_GE(mapped, last);
    last = mapped;
    if (device_s < 10.0) continue;
    const double error = to_seconds(mapped - sampled) - 0.0004;
    const double by_arrival = to_seconds(arrival - sampled) - 0.0004;
    out.rms_s += error * error;
    out.arrival_rms_s += by_arrival * by_arrival;
    out.worst_s = std::max(out.worst_s, std::abs(error));
    ++count;
  }
  out.rms_s = std::sqrt(out.rms_s / count);
  out.arrival_rms_s = std::sqrt(out.arrival_rms_s / count);
  EXPECT_EQ(clock.resets(), 0u);
  return out;
}

TEST(DeviceClockT4, TakesTheJitterOfArrivalAway) {
  const Errors errors = run(0.0, 60.0, 0);
  std::printf("250 Hz, jittery host: %.3f ms RMS, worst %.3f ms; by arrival %.3f ms RMS\n",
              1e3 * errors.rms_s, 1e3 * errors.worst_s, 1e3 * errors.arrival_rms_s);
  EXPECT_GT(errors.arrival_rms_s, 1e-3) << "else there is nothing to take away";
  EXPECT_LT(errors.rms_s, 0.05e-3);
  EXPECT_LT(errors.worst_s, 0.3e-3);
}

TEST(DeviceClockT4, FollowsACrystalAndAResonator) {
  for (const double skew : {50e-6, -50e-6, 5e-3, -5e-3}) {
    const Errors errors = run(skew, 60.0, 0);
    EXPECT_LT(errors.rms_s, 0.1e-3) << skew;
    EXPECT_LT(errors.worst_s, 1e-3) << skew;
  }
}

TEST(DeviceClockT4, GoesOverTheWrapOf32Bits) {
  const Errors errors = run(0.0, 30.0, 0xFFFFFFFFu - 20'000'000u);
  EXPECT_LT(errors.worst_s, 0.3e-3);
}

TEST(DeviceClockT4, AClockThatStandsStillIsNotBelieved) {
  DeviceClock clock;
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(clock.map(777, start + milliseconds(4 * i)), start + milliseconds(4 * i));
}

TEST(DeviceClockT4, BeginsAnewAfterARestartOfTheDevice) {
  DeviceClock clock;
  for (int i = 0; i < 500; ++i)
    clock.map(static_cast<std::uint32_t>(5'000'000 + 4000 * i), start + milliseconds(4 * i));
  // Its time is 0 again, ours goes on.
  for (int i = 500; i < 600; ++i) {
    const TimePoint arrival = start + milliseconds(4 * i);
    const TimePoint mapped = clock.map(static_cast<std::uint32_t>(4000 * (i - 500)), arrival);
    EXPECT_EQ(mapped, arrival) << i;
  }
  EXPECT_EQ(clock.resets(), 1u);
}

TEST(DeviceClockT4, HostileTimesStayBetweenTheReportBeforeAndTheArrival) {
  DeviceClock clock;
  std::uint64_t state = 7;
  TimePoint last = start;
  for (int i = 0; i < 20000; ++i) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    const TimePoint arrival = start + microseconds(500 * i);
    const TimePoint mapped = clock.map(static_cast<std::uint32_t>(state >> 32), arrival);
    ASSERT_LE(mapped, arrival);
    ASSERT_GE(mapped, last);
    last = mapped;
  }
  // Arrivals that run backwards, too.
  EXPECT_GE(clock.map(0, start), last);
}

}  // namespace
}  // namespace handloft::tracking
