#include "daemon-tracking/main/percentiles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace handloft::tracking {
namespace {

TEST(Percentiles, OfKnownValues) {
  Percentiles values;
  for (int i = 100; i >= 0; --i) values.add(i);
  EXPECT_EQ(values.count(), 101u);
  EXPECT_EQ(values.at(0.0), 0.0);
  EXPECT_EQ(values.at(0.5), 50.0);
  EXPECT_EQ(values.at(0.99), 99.0);
  EXPECT_EQ(values.at(1.0), 100.0);
  EXPECT_EQ(values.at(7.0), 100.0);
}

TEST(Percentiles, NothingAndNonsense) {
  Percentiles values;
  EXPECT_EQ(values.at(0.5), 0.0);
  values.add(std::numeric_limits<double>::quiet_NaN());
  values.add(std::numeric_limits<double>::infinity());
  EXPECT_EQ(values.count(), 0u);
  values.add(3.0);
  EXPECT_EQ(values.at(0.5), 3.0);
}

TEST(Percentiles, ThinsEvenlyOverWeeks) {
  // A ramp: whatever part of it was forgotten would shift the percentiles.
  Percentiles values;
  constexpr int count = 1'000'000;
  for (int i = 0; i < count; ++i) values.add(i);
  EXPECT_EQ(values.count(), static_cast<std::uint64_t>(count));
  for (const double fraction : {0.01, 0.25, 0.5, 0.75, 0.99}) {
    EXPECT_NEAR(values.at(fraction), fraction * count, 0.001 * count) << fraction;
  }
}

}  // namespace
}  // namespace handloft::tracking
