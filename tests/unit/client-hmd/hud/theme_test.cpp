// Every word on every ground is readable, in every scheme (V7; WCAG 2.1, 1.4.3 and 1.4.11).

#include "client-hmd/hud/theme.h"

#include <gtest/gtest.h>

#include <initializer_list>

#include "client-hmd/render/colour_vision.h"

namespace handloft::client {
namespace {

/// What is seen where `over` lies over `under` with that opacity, blended as the card does: encoded.
std::uint32_t blended(std::uint32_t over, std::uint32_t under, float opacity) {
  std::uint32_t out = 0;
  for (const unsigned shift : {16U, 8U, 0U}) {
    const auto a = static_cast<float>(over >> shift & 0xFFU), b = static_cast<float>(under >> shift & 0xFFU);
    out |= static_cast<std::uint32_t>(a * opacity + b * (1.0F - opacity) + 0.5F) << shift;
  }
  return out;
}

TEST(Theme, HasWordsThatAreReadableOnEveryGround_V7) {
  for (const ColourScheme scheme : colour_schemes) {
    const Theme& look = theme(scheme);
    // The panels' ground over the darkest and the brightest picture.
    const std::uint32_t on_black = blended(look.ground, 0x000000, look.ground_opacity);
    const std::uint32_t on_white = blended(look.ground, 0xFFFFFF, look.ground_opacity);
    for (const std::uint32_t ground :
         {look.ground, on_black, on_white, look.raised, look.hovered, look.chosen}) {
      for (const std::uint32_t ink : {look.ink, look.faint_ink, look.disabled_ink}) {
        EXPECT_GE(contrast_ratio(ink, ground), smallest_text_contrast)
            << colour_scheme_name(scheme) << std::hex << " ink " << ink << " ground " << ground;
      }
    }
    for (const std::uint32_t ground : {look.ground, on_black, on_white}) {
      for (const std::uint32_t ink : {look.good_ink, look.caution_ink, look.bad_ink}) {
        EXPECT_GE(contrast_ratio(ink, ground), smallest_text_contrast) << colour_scheme_name(scheme);
      }
      EXPECT_GE(contrast_ratio(look.accent, ground), 3.0) << "marks of what is chosen";
    }
    EXPECT_GE(contrast_ratio(look.on_accent, look.accent), smallest_text_contrast);
    EXPECT_GE(contrast_ratio(look.on_accent, look.accent_hovered), smallest_text_contrast);
  }
}

TEST(Theme, OfHighContrastHasSevenToOne) {
  const Theme& look = theme(ColourScheme::high_contrast);
  for (const std::uint32_t ink :
       {look.ink, look.faint_ink, look.disabled_ink, look.good_ink, look.caution_ink, look.bad_ink}) {
    EXPECT_GE(contrast_ratio(ink, look.ground), 7.0);  // WCAG 2.1, 1.4.6
  }
  EXPECT_EQ(look.ground_opacity, 1.0F);
}

TEST(Theme, HasButtonsThatAreLargeEnoughToHit) {
  EXPECT_GE(panel_sizes.button * panel_sizes.text_px, 24.0F);  // WCAG 2.2, 2.5.8
}

}  // namespace
}  // namespace handloft::client
