// Colours that must be told apart are, by everybody (V7, accessibility).

#include "client-hmd/render/colours.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "client-hmd/render/colour_vision.h"

namespace handloft::client {
namespace {

/// What stands side by side and means different things.
std::vector<std::vector<std::uint32_t>> to_be_told_apart(const SceneColours& colours) {
  const auto all = [](const auto& list) { return std::vector<std::uint32_t>(list.begin(), list.end()); };
  return {all(colours.fingers),
          all(colours.users),
          {colours.pressing, colours.resting},
          {colours.profile, colours.boundary, colours.curve},
          {colours.selected, colours.target},
          {colours.control_net, colours.control_point},
          {colours.good, colours.caution, colours.bad},
          {colours.distance.negative, colours.distance.nought, colours.distance.positive},
          {colours.curvature.negative, colours.curvature.nought, colours.curvature.positive}};
}

double smallest_difference(const SceneColours& colours, Sight sight) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& set : to_be_told_apart(colours)) {
    for (std::size_t i = 0; i < set.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j)
        smallest = std::min(smallest, colour_difference(set[i], set[j], sight));
    }
  }
  return smallest;
}

TEST(ColourVision, HasThePublishedDifferences) {
  // Sharma, Wu and Dalal 2005, table 1, pairs 1, 7, 16, 25 and 34.
  EXPECT_NEAR(colour_difference({50.0, 2.6772, -79.7751}, {50.0, 0.0, -82.7485}), 2.0425, 5e-5);
  EXPECT_NEAR(colour_difference({50.0, 0.0, 0.0}, {50.0, -1.0, 2.0}), 2.3669, 5e-5);
  EXPECT_NEAR(colour_difference({50.0, 2.5, 0.0}, {50.0, 0.0, -2.5}), 4.3065, 5e-5);
  EXPECT_NEAR(colour_difference({60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}), 1.2644, 5e-5);
  EXPECT_NEAR(colour_difference({2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}), 0.9082, 5e-5);
}

TEST(ColourVision, KeepsGreyAndConfusesWhatMissingConesWouldTell) {
  for (const Sight sight : all_sights) {
    EXPECT_LT(
        colour_difference(0x808080, 0xFFFFFF, sight) - colour_difference(0x808080, 0xFFFFFF, Sight::normal),
        0.1);
    EXPECT_EQ(colour_difference(0x123456, 0x123456, sight), 0.0);
  }
  // A red and a green on one line of confusion: far apart, but hardly for those without green cones.
  EXPECT_GT(colour_difference(0xC84B3C, 0x7E7A1E, Sight::normal), 25.0);
  EXPECT_LT(colour_difference(0xC84B3C, 0x7E7A1E, Sight::deuteranopia), 12.0);
}

TEST(ColourVision, MeasuresContrastAsTheGuidelineDoes) {
  EXPECT_NEAR(contrast_ratio(0x000000, 0xFFFFFF), 21.0, 1e-4);
  EXPECT_NEAR(contrast_ratio(0xFFFFFF, 0x777777), 4.48, 0.005) << "the guideline's well known near miss";
  EXPECT_NEAR(contrast_ratio(0x123456, 0x123456), 1.0, 1e-9);
}

TEST(Colours, AreToldApartByEverybodyInTheSafeSchemes_V7) {
  for (const ColourScheme scheme : {ColourScheme::colour_blind_safe, ColourScheme::high_contrast}) {
    for (const Sight sight : all_sights) {
      EXPECT_GE(smallest_difference(scene_colours(scheme), sight), smallest_safe_difference)
          << colour_scheme_name(scheme) << ", sight " << static_cast<int>(sight);
    }
  }
}

TEST(Colours, OfTheNormalSchemeAreToldApartByMost_V7) {
  const SceneColours& colours = scene_colours(ColourScheme::normal);
  EXPECT_GE(smallest_difference(colours, Sight::normal), smallest_safe_difference);
  // Why there are other schemes.
  EXPECT_LT(smallest_difference(colours, Sight::protanopia), smallest_safe_difference);
}

TEST(Colours, HaveNamesThatAreFoundAgain) {
  for (const ColourScheme scheme : colour_schemes)
    EXPECT_EQ(colour_scheme_from(colour_scheme_name(scheme)), scheme);
  EXPECT_EQ(colour_scheme_from("sepia"), std::nullopt);
  EXPECT_EQ(colour_scheme_from(""), std::nullopt);
}

TEST(Colours, OfPeopleStayTheirsAndTakeTurns) {
  const ColourScheme scheme = ColourScheme::colour_blind_safe;
  EXPECT_EQ(user_colour(3, scheme), user_colour(3, scheme));
  EXPECT_NE(user_colour(3, scheme), user_colour(4, scheme));
  EXPECT_EQ(user_colour(3, scheme), user_colour(10, scheme)) << "seven, then from the first again";
  EXPECT_EQ(user_colour(std::numeric_limits<std::uint64_t>::max(), scheme),
            scene_colours(scheme).users[std::numeric_limits<std::uint64_t>::max() % 7]);
}

TEST(Colours, OfRampsAreTheEndsAtTheEnds) {
  const DivergingRamp ramp{0x0000FF, 0xFFFFFF, 0xFF0000};
  EXPECT_EQ(ramp_colour(ramp, -1.0F), linear_rgb(0x0000FF));
  EXPECT_EQ(ramp_colour(ramp, 0.0F), linear_rgb(0xFFFFFF));
  EXPECT_EQ(ramp_colour(ramp, std::numeric_limits<float>::infinity()), linear_rgb(0xFF0000));
  EXPECT_EQ(ramp_colour(ramp, std::numeric_limits<float>::quiet_NaN()), linear_rgb(0xFFFFFF));
  EXPECT_NEAR(ramp_colour(ramp, 0.5F).g, 0.5F, 1e-6F);
}

TEST(Colours, AreDecodedAndHandedThrough) {
  EXPECT_NEAR(linear_rgb(0x808080).r, 0.2158605F, 1e-6F);
  EXPECT_EQ(overlay_rgba(0xFF0000, 0.25F), glm::vec4(1.0F, 0.0F, 0.0F, 0.25F));
}

}  // namespace
}  // namespace handloft::client
