// Percentiles over the last ten seconds and the histogram (T15), by hand values.

#include "daemon-tracking/main/latency_window.h"

#include <gtest/gtest.h>

#include <limits>

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

TEST(LatencyWindow, PercentilesByNearestRank) {
  LatencyWindow window;
  for (int i = 100; i >= 1; --i) window.add(from_ns(1'000'000 * (200 - i)), i);
  const LatencyPercentiles figures = window.at(from_ns(200'000'000));
  EXPECT_EQ(figures.frames, 100u);
  EXPECT_EQ(figures.p50_ms, 50.0);
  EXPECT_EQ(figures.p95_ms, 95.0);
  EXPECT_EQ(figures.p99_ms, 99.0);
}

TEST(LatencyWindow, WhatIsOlderThanTenSecondsIsForgotten) {
  LatencyWindow window;
  const TimePoint start = from_ns(5'000'000'000);
  window.add(start, 80.0);
  window.add(start + 9s, 4.0);
  EXPECT_EQ(window.at(start + 10s).p99_ms, 80.0);
  const LatencyPercentiles later = window.at(start + 11s);
  EXPECT_EQ(later.frames, 1u);
  EXPECT_EQ(later.p99_ms, 4.0);
  EXPECT_EQ(window.at(start + 60s).frames, 0u);
  EXPECT_EQ(window.at(start + 60s).p50_ms, 0.0);
  EXPECT_EQ(window.histogram().count(), 2u) << "the histogram forgets nothing";
}

TEST(LatencyWindow, NoNumberIsLeftOut) {
  LatencyWindow window;
  window.add(from_ns(1), std::numeric_limits<double>::quiet_NaN());
  window.add(from_ns(1), std::numeric_limits<double>::infinity());
  EXPECT_EQ(window.at(from_ns(2)).frames, 0u);
}

TEST(LatencyWindow, ItsMemoryIsBounded) {
  LatencyWindow window;
  for (int i = 0; i < 20'000; ++i) window.add(from_ns(i), 1.0);
  EXPECT_LE(window.at(from_ns(20'000)).frames, 8192u);
}

TEST(LatencyHistogram, BucketsCumulate) {
  LatencyHistogram histogram;
  for (const double ms : {0.5, 1.0, 1.5, 100.0, 1000.0}) histogram.add(ms);
  EXPECT_EQ(histogram.up_to[0], 2u) << "1 ms is within the bound of 1 ms";
  EXPECT_EQ(histogram.up_to[1], 3u);
  EXPECT_EQ(histogram.up_to[LatencyHistogram::bounds_ms.size() - 1], 4u);
  EXPECT_EQ(histogram.count(), 5u);
  EXPECT_EQ(histogram.sum_ms, 1103.0);
}

}  // namespace
}  // namespace handloft::tracking
