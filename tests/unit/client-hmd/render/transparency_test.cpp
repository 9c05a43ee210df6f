#include "client-hmd/render/transparency.h"

#include <gtest/gtest.h>

namespace handloft::client {
namespace {

TEST(TransparencyWeight, FallsWithDepthAndIsProportionalToOpacity_V2) {
  EXPECT_FLOAT_EQ(transparency_weight(1.0F, 0.5F), 1.0F);
  EXPECT_FLOAT_EQ(transparency_weight(0.3F, 0.5F), 0.3F);
  EXPECT_NEAR(transparency_weight(1.0F, 0.55F), std::exp(-1.0F), 1e-5F);
  float last = transparency_weight(0.5F, 0.3F);
  for (float depth = 0.31F; depth < 0.8F; depth += 0.01F) {
    const float weight = transparency_weight(0.5F, depth);
    EXPECT_LT(weight, last);
    last = weight;
  }
}

TEST(TransparencyWeight, StaysWithinAHalfFloatForHundredsOfLayers) {
  constexpr float largest_half = 65504.0F;
  float sum = 0.0F;
  for (int layer = 0; layer < 500; ++layer) sum += transparency_weight(1.0F, 0.03F);
  EXPECT_LT(sum, largest_half);
  EXPECT_GT(transparency_weight(0.05F, 100.0F), 6e-8F) << "above the smallest half float";
}

}  // namespace
}  // namespace handloft::client
