// Histograms as Prometheus reads them.

#include "common/base/histogram.h"

#include <gmock/gmock.h>

#include <chrono>
#include <thread>
#include <vector>

namespace handloft {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

TEST(Histogram, CountsBelowEachBound) {
  Histogram histogram;
  for (const Duration each : {Duration(100us), Duration(101us), Duration(2ms), Duration(20s), Duration(-1s)})
    histogram.add(each);
  MetricsText text;
  text.family("wait_seconds", "histogram", "How long");
  histogram.write(text, "of=\"x\"");
  const std::string all = text.take();
  EXPECT_THAT(all, HasSubstr("handloft_wait_seconds_bucket{of=\"x\",le=\"0.0001\"} 2\n"));
  EXPECT_THAT(all, HasSubstr("handloft_wait_seconds_bucket{of=\"x\",le=\"0.00025\"} 3\n"));
  EXPECT_THAT(all, HasSubstr("handloft_wait_seconds_bucket{of=\"x\",le=\"10\"} 4\n"));
  EXPECT_THAT(all, HasSubstr("handloft_wait_seconds_bucket{of=\"x\",le=\"+Inf\"} 5\n"));
  EXPECT_THAT(all, HasSubstr("handloft_wait_seconds_count{of=\"x\"} 5\n"));
  EXPECT_THAT(all, HasSubstr("handloft_wait_seconds_sum{of=\"x\"} 20.002201\n"));
}

TEST(Histogram, ManyThreadsLoseNothing) {
  Histogram histogram;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int n = 0; n < 10'000; ++n) histogram.add(std::chrono::microseconds(n));
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(histogram.count(), 40'000U);
}

}  // namespace
}  // namespace handloft
