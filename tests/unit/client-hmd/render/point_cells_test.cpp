// Large clouds in cells (V3): nothing is lost, what is out of sight costs nothing, and fewer discs let as
// much light through as all of them.

#include "client-hmd/render/point_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

namespace handloft::client {
namespace {

/// A wavy sheet of n points, 0.2 m wide.
PointSet sheet(std::size_t n, float radius_m = 0.002F) {
  PointSet set;
  ShellStyle style;
  style.radius_m = radius_m;
  set.styles = {style, style, style};
  for (std::size_t i = 0; i < n; ++i) {
    const auto x = static_cast<float>(std::fmod(0.754877666 * static_cast<double>(i), 1.0));
    const auto y = static_cast<float>(std::fmod(0.569840291 * static_cast<double>(i), 1.0));
    set.points.push_back({{0.2F * x - 0.1F, 0.2F * y - 0.1F, 0.05F + 0.01F * std::sin(20.0F * x)},
                          static_cast<std::uint32_t>(i % 3)});
  }
  return set;
}

glm::vec3 place(const PointCell& cell, const PackedPoint& point) {
  return cell.low + cell.size * glm::vec3(point.x, point.y, point.z) / 65535.0F;
}

CellView above(float distance_m, float most_layers = 24.0F) {
  CellView view;
  view.eye = {0.0F, 0.0F, 0.05F + distance_m};
  const glm::mat4 eye_from_world =
      glm::lookAt(view.eye, glm::vec3(0.0F, 0.0F, 0.05F), glm::vec3(0.0F, 1.0F, 0.0F));
  view.clip_from_world = glm::perspective(0.8F, 16.0F / 9.0F, 0.01F, 20.0F) * eye_from_world;
  view.focal_px = 1277.0F;
  view.most_layers = most_layers;
  return view;
}

TEST(PointCells, KeepEveryPointWithinAMicrometreAndItsStyle_V3) {
  const PointSet set = sheet(50'000);
  const auto made = into_cells(set, set.points.size());
  ASSERT_TRUE(made);
  ASSERT_EQ(made->points.size(), set.points.size());
  EXPECT_GT(made->cells.size(), 10U);
  // Sums of all places: a permutation keeps them.
  glm::dvec3 before(0.0), after(0.0);
  std::size_t styles_before = 0, styles_after = 0, counted = 0;
  for (const FuzzyPoint& p : set.points) {
    before += glm::dvec3(p.position.x, p.position.y, p.position.z);
    styles_before += p.style;
  }
  for (const PointCell& cell : made->cells) {
    EXPECT_EQ(cell.first, counted);
    counted += cell.count;
    EXPECT_LT(std::max({cell.size.x, cell.size.y, cell.size.z}), 0.065F) << "so that 1/65535 is a micrometre";
    for (std::uint32_t i = cell.first; i < cell.first + cell.count; ++i) {
      after += glm::dvec3(place(cell, made->points[i]));
      styles_after += made->points[i].style;
    }
  }
  EXPECT_EQ(counted, set.points.size());
  EXPECT_EQ(styles_before, styles_after);
  EXPECT_LT(glm::length(before - after) / static_cast<double>(counted), 1e-6);
}

TEST(PointCells, SpreadAnyBeginningOverTheCell_V3) {
  const PointSet set = sheet(50'000);
  const auto made = into_cells(set, set.points.size());
  ASSERT_TRUE(made);
  for (const PointCell& cell : made->cells) {
    if (cell.count < 400) continue;
    // The mean of a tenth is that of all but for what chance would do (a quarter of the box is far off).
    glm::vec3 all(0.0F), tenth(0.0F);
    for (std::uint32_t i = 0; i < cell.count; ++i) {
      const glm::vec3 at = place(cell, made->points[cell.first + i]);
      all += at;
      if (i < cell.count / 10) tenth += at;
    }
    const glm::vec3 off = tenth / static_cast<float>(cell.count / 10) - all / static_cast<float>(cell.count);
    EXPECT_LT(std::abs(off.x), 0.2F * cell.size.x);
    EXPECT_LT(std::abs(off.y), 0.2F * cell.size.y);
  }
}

TEST(PointCells, LeaveOutWhatIsOutOfSightOnly_V3) {
  const PointSet set = sheet(50'000);
  const auto made = into_cells(set, set.points.size());
  ASSERT_TRUE(made);
  std::size_t seen = 0, hidden = 0;
  for (const PointCell& cell : made->cells) seen += share_of(cell, above(0.5F, 1e9F)).count;
  EXPECT_EQ(seen, set.points.size()) << "all of it is in the picture";
  CellView aside = above(0.5F, 1e9F);
  aside.clip_from_world =
      aside.clip_from_world * glm::translate(glm::mat4(1.0F), glm::vec3(3.0F, 0.0F, 0.0F));
  for (const PointCell& cell : made->cells) hidden += share_of(cell, aside).count;
  EXPECT_EQ(hidden, 0U);
  CellView half = above(0.5F, 1e9F);
  half.clip_from_world = half.clip_from_world * glm::translate(glm::mat4(1.0F), glm::vec3(0.37F, 0.0F, 0.0F));
  std::size_t some = 0;
  for (const PointCell& cell : made->cells) some += share_of(cell, half).count;
  EXPECT_GT(some, 0U);
  EXPECT_LT(some, set.points.size());
}

TEST(PointCells, ThinOutOnlyWhatLiesManyTimesOverEachOther_V3) {
  const PointSet dense = sheet(200'000), thin = sheet(20'000, 0.0005F);
  const auto many = into_cells(dense, dense.points.size()), few = into_cells(thin, thin.points.size());
  ASSERT_TRUE(many && few);
  const CellView near = above(0.5F), far = above(4.0F);
  std::size_t near_count = 0, far_count = 0, thin_count = 0;
  for (const PointCell& cell : many->cells) {
    const CellShare share = share_of(cell, near);
    near_count += share.count;
    EXPECT_NEAR(share.boost * static_cast<float>(share.count), static_cast<float>(cell.count), 1.0F)
        << "those that are drawn stand for all";
    far_count += share_of(cell, far).count;
  }
  for (const PointCell& cell : few->cells) thin_count += share_of(cell, near).count;
  EXPECT_LT(near_count, dense.points.size() * 2 / 3) << "63 discs over each other, at the cells' edges fewer";
  EXPECT_LE(far_count, near_count) << "never more from farther away";
  EXPECT_EQ(thin_count, thin.points.size()) << "every point of it is seen";
}

TEST(PointCells, TakeOddClouds_F1) {
  PointSet set;
  EXPECT_FALSE(into_cells(set, 10));
  set.styles.resize(1);
  set.points.assign(30'000, FuzzyPoint{{1.0F, 2.0F, 3.0F}, 0});
  const auto same = into_cells(set, set.points.size());  // All in one place.
  ASSERT_TRUE(same);
  ASSERT_EQ(same->cells.size(), 1U);
  EXPECT_EQ(same->cells[0].count, 30'000U);
  const CellShare share = share_of(same->cells[0], above(0.5F));
  EXPECT_TRUE(std::isfinite(share.boost));
  set.points.back().position = {1e4F, -1e4F, 1e4F};  // As far as the mirror lets anything be.
  EXPECT_TRUE(into_cells(set, set.points.size()));
  set.styles.resize(max_packed_styles + 1);
  EXPECT_FALSE(into_cells(set, set.points.size())) << "more styles than two bytes name";
}

}  // namespace
}  // namespace handloft::client
