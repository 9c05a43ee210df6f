#include "client-hmd/render/distance_map.h"

#include <gtest/gtest.h>

#include <limits>

namespace handloft::client {
namespace {

TEST(DistanceMap, HasItsColoursAtTheEndsAndInTheMiddle_A28) {
  const DistanceColours colours;
  EXPECT_EQ(distance_colour(-1.0F), colours.negative);
  EXPECT_EQ(distance_colour(0.0F), colours.nought);
  EXPECT_EQ(distance_colour(1.0F), colours.positive);
  EXPECT_EQ(distance_colour(-7.0F), colours.negative);
  EXPECT_EQ(distance_colour(std::numeric_limits<float>::infinity()), colours.positive);
  EXPECT_EQ(distance_colour(std::numeric_limits<float>::quiet_NaN()), colours.nought);
  EXPECT_NEAR(distance_colour(0.5F).g, 0.5F * (colours.nought.g + colours.positive.g), 1e-6F);
}

TEST(DistanceMap, GrowsDarkerOnBothSidesSoThatNoughtIsFound_A28) {
  const auto luminance = [](const glm::vec3& c) { return 0.2126F * c.r + 0.7152F * c.g + 0.0722F * c.b; };
  for (const float side : {-1.0F, 1.0F}) {
    float before = luminance(distance_colour(0.0F));
    for (int i = 1; i <= 10; ++i) {
      const float now = luminance(distance_colour(side * static_cast<float>(i) / 10.0F));
      EXPECT_LT(now, before);
      before = now;
    }
  }
}

TEST(DistanceMap, EncodesForTheOverlay) {
  // The ends are near (36, 102, 178) and (230, 124, 22).
  const glm::vec4 negative = 255.0F * distance_colour_srgb(-1.0F);
  EXPECT_NEAR(negative.r, 36.0F, 1.5F);
  EXPECT_NEAR(negative.g, 102.0F, 1.5F);
  EXPECT_NEAR(negative.b, 178.0F, 1.5F);
  EXPECT_EQ(negative.a, 255.0F);
  const glm::vec4 positive = 255.0F * distance_colour_srgb(1.0F);
  EXPECT_NEAR(positive.r, 230.0F, 1.5F);
  EXPECT_NEAR(positive.g, 124.0F, 1.5F);
  EXPECT_NEAR(positive.b, 22.0F, 2.5F);
}

}  // namespace
}  // namespace handloft::client
