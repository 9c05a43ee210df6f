#include <gtest/gtest.h>

#include "client-hmd/render/point_pass.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client {
namespace {

TEST(Shells, CompositeToTheStaircaseOfA3) {
  for (const double rho : {0.25, 0.5, 0.8, 1.0}) {
    const ShellStyle style = test::fuzzy_style(rho);
    for (int k = 1; k <= 5; ++k) {
      const double r_mid = style.radius_m * (k - 0.5) / 5.0;
      const double expected = rho * (1.0 - (k - 0.5) / 5.0);
      EXPECT_NEAR(shells_opacity(style, static_cast<float>(r_mid)), expected, 1e-6) << rho << " " << k;
    }
    EXPECT_EQ(shells_opacity(style, style.radius_m * 1.001F), 0.0F);
  }
}

TEST(Shells, HaveTheAlphasThatWereMeasuredForA3) {
  const ShellStyle style = test::fuzzy_style(0.8);
  const std::array<float, 5> expected{0.0800F, 0.1739F, 0.2105F, 0.2667F, 0.3636F};
  for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(style.shell_alpha[k], expected[k], 5e-5F);
}

TEST(Shells, StayWithinATenthOfTheLinearLaw_A3) {
  const double rho = 0.7;
  const ShellStyle style = test::fuzzy_style(rho);
  for (double r = 0.0; r < style.radius_m; r += style.radius_m / 200.0) {
    EXPECT_LE(std::abs(shells_opacity(style, static_cast<float>(r)) - rho * (1.0 - r / style.radius_m)),
              rho / 10.0 + 1e-5);
  }
}

}  // namespace
}  // namespace handloft::client
