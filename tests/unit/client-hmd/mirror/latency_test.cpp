#include "client-hmd/mirror/latency.h"

#include <gtest/gtest.h>

namespace handloft::client {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(LatencyHistogram, EmptyIsZero) {
  EXPECT_EQ(LatencyHistogram().quantile_ms(0.5), 0.0);
}

TEST(LatencyHistogram, GivesMedianAndTailToAQuarterMillisecond) {
  LatencyHistogram histogram;
  for (int i = 1; i <= 100; ++i) histogram.add(milliseconds(i) - microseconds(10));
  EXPECT_NEAR(histogram.quantile_ms(0.5), 50.0, 0.25);
  EXPECT_NEAR(histogram.quantile_ms(0.99), 99.0, 0.25);
  EXPECT_NEAR(histogram.quantile_ms(0.0), 1.0, 0.25);
}

TEST(LatencyHistogram, ClampsWhatCannotBe) {
  LatencyHistogram histogram;
  histogram.add(-seconds(5));
  histogram.add(seconds(3600));
  EXPECT_EQ(histogram.count(), 2U);
  EXPECT_NEAR(histogram.quantile_ms(0.5), 0.25, 1e-12);
  EXPECT_NEAR(histogram.quantile_ms(1.0), 2000.0, 1e-9);
}

}  // namespace
}  // namespace handloft::client
