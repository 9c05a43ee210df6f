// Mattes give back what was composited.

#include "client-hmd/shots/matte.h"

#include <gtest/gtest.h>

#include <cmath>

namespace handloft::client {
namespace {

std::uint8_t srgb(double linear) {
  const double c = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255.0 * c));
}

/// One pixel of light `c` and opacity `a` before a grey of `background`.
Image before(double c, double a, double background) {
  const std::uint8_t byte = srgb(a * c + (1 - a) * background);
  return {1, 1, {byte, byte, byte, 255}};
}

TEST(Matte, GivesBackColourAndOpacity_V8) {
  for (const double colour : {0.05, 0.3, 0.7}) {
    for (const double opacity : {0.0, 0.25, 0.5, 0.9, 1.0}) {
      const auto image =
          difference_matte(before(colour, opacity, 0.0), before(colour, opacity, double{matte_grey}));
      ASSERT_TRUE(image.ok());
      EXPECT_NEAR(image->rgba[3], 255.0 * opacity, 2.0) << colour << " " << opacity;
      if (opacity > 0.2) {
        EXPECT_NEAR(image->rgba[0], srgb(colour), 5.0) << colour << " " << opacity;
      }
    }
  }
}

TEST(Matte, NeedsTwoPicturesOfASize) {
  EXPECT_FALSE(difference_matte(before(0.1, 1, 0), Image{2, 1, std::vector<std::uint8_t>(8)}).ok());
}

}  // namespace
}  // namespace handloft::client
