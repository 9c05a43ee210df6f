#include "server-model/geometry/fuzzy_point.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace handloft::geometry {
namespace {

constexpr double half_inch_m = 0.0127;

TEST(FuzzyPoint, A2_HandValuesOfEq1) {
  EXPECT_NEAR(fuzzy_radius(0.25), 0.375 * 0.0254, 1e-15);
  EXPECT_DOUBLE_EQ(fuzzy_opacity(0, 0.25), 0.25);
  EXPECT_EQ(fuzzy_opacity(fuzzy_radius(0.25), 0.25), 0);
  for (int i = 0; i <= 100; ++i) {  // Linear from rho in the middle to 0 at the rim.
    EXPECT_NEAR(fuzzy_opacity(fuzzy_radius(0.25) * i / 100, 0.25), 0.25 * (1 - i / 100.0), 1e-12);
  }
  EXPECT_EQ(fuzzy_opacity(2 * fuzzy_radius(0.25), 0.25), 0);
}

TEST(FuzzyPoint, A2_TheMostCertainPointIsSmallAndNotNothing) {
  EXPECT_DOUBLE_EQ(fuzzy_radius(1.0), 0.02 * half_inch_m);
  EXPECT_DOUBLE_EQ(fuzzy_opacity(0, 1.0), 1.0);
}

TEST(FuzzyPoint, A2_MonotoneInPressure) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_GE(fuzzy_radius(i / 100.0), fuzzy_radius((i + 1) / 100.0));
    EXPECT_LE(fuzzy_opacity(0, i / 100.0), fuzzy_opacity(0, (i + 1) / 100.0));
  }
}

TEST(FuzzyPoint, A3_HandValuesAtPressureFourFifths) {
  const auto shells = fuzzy_shells(0.8);
  const std::array<double, 5> alphas{0.0800, 0.1739, 0.2105, 0.2667, 0.3636};
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_NEAR(shells[k].alpha, alphas[k], 5e-5) << k;
    EXPECT_NEAR(shells[k].radius_m, fuzzy_radius(0.8) * (1 - 0.2 * static_cast<double>(k)), 1e-15) << k;
  }
}

TEST(FuzzyPoint, A3_CompositeIsTheStaircaseWithinATenthOfLinear) {
  for (const double rho : {0.1, 0.5, 0.8, 1.0}) {
    const auto shells = fuzzy_shells(rho);
    for (int i = 0; i < 1000; ++i) {
      const double r = fuzzy_radius(rho) * (i + 0.5) / 1000;
      double composite = 0;  // 'over' of all shells around r
      for (const FuzzyShell& shell : shells) {
        if (r < shell.radius_m) composite += (1 - composite) * shell.alpha;
      }
      const int step = i / 200;  // 0 = innermost
      const double staircase = rho * (1 - (step + 0.5) / 5);
      EXPECT_NEAR(composite, staircase, 1e-12);
      EXPECT_LE(std::abs(composite - fuzzy_opacity(r, rho)), rho / 10 + 1e-12);
    }
  }
}

TEST(FuzzyPoint, BadPressureIsClamped) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DOUBLE_EQ(fuzzy_radius(nan), half_inch_m);
  EXPECT_EQ(fuzzy_opacity(nan, 0.5), 0);
  EXPECT_DOUBLE_EQ(fuzzy_radius(7), fuzzy_radius(1));
  EXPECT_DOUBLE_EQ(fuzzy_radius(-7), half_inch_m);
}

}  // namespace
}  // namespace handloft::geometry
