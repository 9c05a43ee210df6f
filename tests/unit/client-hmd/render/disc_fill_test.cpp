// What discs cost a picture (V3, V5): counted as the graphics card works on them, and bounded however many
// and however large a server sends them.

#include "client-hmd/render/disc_fill.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "client-hmd/render/point_cells.h"

namespace handloft::client {
namespace {

constexpr float distance_m = 0.5F, focal_px = 600.0F;
const glm::vec2 viewport_px(640.0F, 480.0F);

/// Along -z from (0, 0, distance_m).
DiscView from_above() {
  DiscView view;
  view.eye_from_world = glm::translate(glm::mat4(1.0F), glm::vec3(0.0F, 0.0F, -distance_m));
  view.clip_from_eye = glm::perspective(2.0F * std::atan(0.5F * viewport_px.y / focal_px),
                                        viewport_px.x / viewport_px.y, 0.01F, 20.0F);
  view.viewport_px = viewport_px;
  view.focal_px = focal_px;
  view.smallest_px = 1.0F;
  return view;
}

/// Of a disc that costs nothing but its being there.
float of_any() {
  return disc_cost_px({0.0F, 0.0F, 2.0F}, 0.01F, from_above());
}

TEST(DiscFill, CountsTheSquareOfADiscInThePicture_V3) {
  // 10 mm at 0.5 m and 600 px: a radius of 12 px, and a pixel more for its soft edge.
  EXPECT_NEAR(disc_cost_px({0.0F, 0.0F, 0.0F}, 0.01F, from_above()) - of_any(), 26.0F * 26.0F, 1.0F);
  // Half of it is beyond the left edge.
  const float left = -0.5F * viewport_px.x / focal_px * distance_m;
  EXPECT_NEAR(disc_cost_px({left, 0.0F, 0.0F}, 0.01F, from_above()) - of_any(), 13.0F * 26.0F, 1.0F);
  // The smallest are drawn with a radius of a pixel.
  EXPECT_NEAR(disc_cost_px({0.0F, 0.0F, 0.0F}, 1e-6F, from_above()) - of_any(), 4.0F * 4.0F, 0.1F);
}

TEST(DiscFill, CountsNoMoreThanThePictureAndNothingBehindTheEye_V3) {
  EXPECT_NEAR(disc_cost_px({0.0F, 0.0F, 0.0F}, 1.0F, from_above()) - of_any(), viewport_px.x * viewport_px.y,
              1.0F);
  EXPECT_EQ(disc_cost_px({0.0F, 0.0F, distance_m + 0.1F}, 1.0F, from_above()), of_any());
  EXPECT_EQ(disc_cost_px({0.0F, 0.0F, distance_m}, 1.0F, from_above()), of_any()) << "in the eye itself";
  EXPECT_EQ(disc_cost_px({1e4F, -1e4F, 0.0F}, 1.0F, from_above()), of_any());
}

TEST(DiscFill, EstimatesPointsFromASampleOfThem_V3) {
  PointSet set;
  set.styles.resize(2);
  set.styles[0].radius_m = 0.01F;
  set.styles[1].radius_m = 0.02F;
  double exact = 0.0;
  for (std::uint32_t i = 0; i < 10'007; ++i) {
    const float x = 0.4F * (static_cast<float>(i) / 10'007.0F - 0.5F);
    set.points.push_back({{x, 0.3F * x, 0.1F * x}, i % 2});
    exact +=
        static_cast<double>(disc_cost_px({x, 0.3F * x, 0.1F * x}, set.styles[i % 2].radius_m, from_above()));
  }
  EXPECT_NEAR(cost_px(set.points, set.styles, from_above()) / exact, 1.0, 0.1);
  EXPECT_EQ(cost_px({}, set.styles, from_above()), 0.0);
}

TEST(DiscFill, LeavesOutNoneOfWhatCoversThePictureAFewTimes_V3) {
  const double picture = static_cast<double>(viewport_px.x * viewport_px.y);
  EXPECT_EQ(share_within(10.0 * picture, from_above(), 64.0F), 1.0);
  EXPECT_EQ(share_within(0.0, from_above(), 64.0F), 1.0);
  EXPECT_DOUBLE_EQ(share_within(640.0 * picture, from_above(), 64.0F), 0.1);
}

TEST(DiscFill, TakesEveryNthSoThatTogetherTheyStandForAll_V3) {
  EXPECT_EQ(every_nth(1000, 1.0).n, 1U);
  EXPECT_EQ(every_nth(1000, 1.0).count, 1000U);
  EXPECT_EQ(every_nth(1000, 1.0).boost, 1.0F);
  for (const double share : {0.9, 0.3, 0.01, 1e-5, 0.0}) {
    const EveryNth every = every_nth(1000, share);
    ASSERT_GE(every.count, 1U);
    EXPECT_LE(static_cast<double>(every.count), std::max(1.0, 1000.0 * share + 1.0)) << share;
    EXPECT_LT((every.count - 1) * every.n, 1000U) << "none beyond the last";
    EXPECT_FLOAT_EQ(every.boost * static_cast<float>(every.count), 1000.0F);
  }
  EXPECT_EQ(every_nth(0, 0.5).count, 0U);
}

TEST(DiscFill, ThinsACellsShareAndKeepsOneOfIt_V3) {
  const CellShare all{800, 2.0F};
  EXPECT_EQ(thinned(all, 1.0).count, 800U);
  const CellShare fewer = thinned(all, 0.25);
  EXPECT_EQ(fewer.count, 200U);
  EXPECT_FLOAT_EQ(fewer.boost, 8.0F);
  EXPECT_EQ(thinned(all, 1e-9).count, 1U);
  EXPECT_EQ(thinned({}, 0.5).count, 0U) << "out of sight";
}

TEST(DiscFill, KnowsACellByAFewOfItsPoints_V3) {
  PointSet set;
  set.styles.resize(1);
  set.styles[0].radius_m = 0.004F;
  for (int i = 0; i < 30'000; ++i) {
    const auto x = static_cast<float>(i % 200), y = static_cast<float>(i) / 200.0F;
    set.points.push_back({{0.002F * x - 0.2F, 0.002F * y - 0.15F, 0.0F}, 0});
  }
  const auto cells = into_cells(set, set.points.size());
  ASSERT_TRUE(cells);
  double sum = 0.0;
  for (const PointCell& cell : cells->cells) {
    sum += static_cast<double>(cell.count) *
           static_cast<double>(mean_disc_cost_px(cell, *cells, set.styles, from_above()));
  }
  EXPECT_NEAR(sum / cost_px(set.points, set.styles, from_above()), 1.0, 0.15);
}

}  // namespace
}  // namespace handloft::client
