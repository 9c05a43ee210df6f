// A21: which part of a stroke belongs to which surface.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "server-model/geometry/resample.h"
#include "server-model/geometry/stroke_partition.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

/// A flat tile of 2 * half about a centre in the plane of the frame, seen as a near rectangle.
ProfileCandidate tile(const Frame& frame, const Vec2& half) {
  ProfileCandidate candidate;
  candidate.frame = frame;
  const Superellipse shape = *Superellipse::create({Vec2::Zero(), half}, 20);
  candidate.outside_m = [shape](const Vec2& xy) { return distance_outside(shape, xy); };
  return candidate;
}

Frame at(const Vec3& origin) {
  return {origin, Mat3::Identity()};
}

std::vector<Vec3> line(const Vec3& from, const Vec3& to, std::size_t n = 100) {
  return *resample_evenly(std::vector<Vec3>{from, to}, n);
}

TEST(StrokePartition, A21_DividesWhereTheFootprintsMeet) {
  const std::vector<ProfileCandidate> tiles = {tile(at({-0.05, 0, 0}), {0.05, 0.05}),
                                               tile(at({0.05, 0, 0}), {0.05, 0.05})};
  // 8 : 6 of the way on the left one.
  const auto division = divide_stroke(line({-0.08, 0, 0.01}, {0.06, 0.01, 0.01}), tiles);
  ASSERT_TRUE(division.ok());
  EXPECT_EQ(division->owners, (std::vector<std::size_t>{0, 1}));
  ASSERT_EQ(division->split_at.size(), 1U);
  EXPECT_NEAR(division->split_at[0], 8.0 / 14, 0.02);
  EXPECT_NEAR(division->nearest_m, 0.01, 1e-12);
}

TEST(StrokePartition, A21_AtAnEdgeTheNearerSurfaceOwns) {
  // A seat and its back, at a right angle along the y axis: the border is the bisector.
  Frame back;
  back.rotation.col(0) = Vec3::UnitZ();
  back.rotation.col(1) = Vec3::UnitY();
  back.rotation.col(2) = -Vec3::UnitX();
  back.origin = {0, 0, 0.2};
  const std::vector<ProfileCandidate> seat = {tile(at({0.2, 0, 0}), {0.2, 0.2}), tile(back, {0.2, 0.2})};
  std::vector<Vec3> stroke;
  for (int i = 0; i <= 200; ++i) {
    const double angle = std::numbers::pi / 2 * i / 200.0;
    stroke.push_back({0.05 + 0.1 * (1 - std::sin(angle)), 0, 0.05 + 0.1 * (1 - std::cos(angle))});
  }
  const auto division = divide_stroke(stroke, seat);
  ASSERT_EQ(division->owners, (std::vector<std::size_t>{0, 1}));
  EXPECT_NEAR(division->split_at[0], 0.5, 0.01);
}

TEST(StrokePartition, A21_JitterAtTheBorderDoesNotShredTheStroke) {
  std::mt19937_64 random(60);
  const std::vector<ProfileCandidate> tiles = {tile(at({-0.05, 0, 0}), {0.03, 0.05}),
                                               tile(at({0.05, 0, 0}), {0.03, 0.05})};
  // Along the border between the two, 2 mm to and fro, then off to the right.
  std::vector<Vec3> stroke;
  for (int i = 0; i < 100; ++i) stroke.push_back({test::uniform(random, -2e-3, 2e-3), -0.05 + 5e-4 * i, 0});
  for (int i = 0; i < 100; ++i) stroke.push_back({5e-4 * i, 0, 0});
  const auto division = divide_stroke(stroke, tiles);
  ASSERT_TRUE(division.ok());
  EXPECT_LE(division->owners.size(), 2U);
  EXPECT_EQ(division->owners.back(), 1U);
  // Negative control: without hysteresis it falls to pieces.
  const auto shredded = divide_stroke(stroke, tiles, {.hysteresis_m = 1e-9});
  EXPECT_GT(shredded->owners.size(), 10U);
}

TEST(StrokePartition, A21_GoingOverAndBackGivesThreeParts) {
  const std::vector<ProfileCandidate> tiles = {tile(at({-0.05, 0, 0}), {0.04, 0.05}),
                                               tile(at({0.05, 0, 0}), {0.04, 0.05})};
  std::vector<Vec3> stroke = line({-0.06, -0.02, 0}, {0.06, -0.02, 0});
  const std::vector<Vec3> back = line({0.06, 0.02, 0}, {-0.06, 0.02, 0});
  stroke.insert(stroke.end(), back.begin(), back.end());
  const auto division = divide_stroke(stroke, tiles);
  EXPECT_EQ(division->owners, (std::vector<std::size_t>{0, 1, 0}));
  EXPECT_NEAR(division->split_at[0] + division->split_at[1], 1, 0.01);
}

TEST(StrokePartition, A21_DirectionDoesNotMatter) {
  std::mt19937_64 random(61);
  const std::vector<ProfileCandidate> tiles = {tile(at({-0.06, 0, 0.01}), {0.03, 0.05}),
                                               tile(at({0.0, 0, 0}), {0.02, 0.05}),
                                               tile(at({0.06, 0.01, -0.01}), {0.03, 0.05})};
  std::vector<Vec3> stroke = line({-0.09, -0.02, 0}, {0.09, 0.03, 0.02}, 200);
  for (Vec3& p : stroke) p += 1e-3 * Vec3(test::uniform(random, -1, 1), test::uniform(random, -1, 1), 0);
  auto forth = divide_stroke(stroke, tiles);
  std::reverse(stroke.begin(), stroke.end());
  auto back = divide_stroke(stroke, tiles);
  ASSERT_EQ(forth->owners, (std::vector<std::size_t>{0, 1, 2}));
  ASSERT_EQ(back->owners, (std::vector<std::size_t>{2, 1, 0}));
  EXPECT_NEAR(forth->split_at[0] + back->split_at[1], 1, 1e-9);
  EXPECT_NEAR(forth->split_at[1] + back->split_at[0], 1, 1e-9);
}

TEST(StrokePartition, A21_FarAwayIsNobodys) {
  const std::vector<ProfileCandidate> tiles = {tile(at({0, 0, 0}), {0.05, 0.05})};
  const auto off = divide_stroke(line({-0.03, 0, 0}, {0.5, 0, 0}, 300), tiles);
  EXPECT_EQ(off->owners, (std::vector<std::size_t>{0, nobody}));
  const auto above = divide_stroke(line({-0.03, 0, 0.5}, {0.03, 0, 0.5}), tiles);
  EXPECT_EQ(above->owners, (std::vector<std::size_t>{nobody}));
  EXPECT_NEAR(above->nearest_m, 0.5, 1e-12);
  const auto none = divide_stroke(line({-0.03, 0, 0}, {0.03, 0, 0}), {});
  EXPECT_EQ(none->owners, (std::vector<std::size_t>{nobody}));
  EXPECT_EQ(none->nearest_m, std::numeric_limits<double>::infinity());
}

TEST(StrokePartition, DotsAndBadInput) {
  const std::vector<ProfileCandidate> tiles = {tile(at({0, 0, 0}), {0.05, 0.05}),
                                               tile(at({0, 0, 0.03}), {0.05, 0.05})};
  const auto dot = divide_stroke(std::vector<Vec3>{{0, 0, 0.02}}, tiles);
  EXPECT_EQ(dot->owners, (std::vector<std::size_t>{1}));
  EXPECT_TRUE(dot->split_at.empty());
  EXPECT_EQ(divide_stroke({}, tiles).error().field, "points");
  EXPECT_EQ(divide_stroke(std::vector<Vec3>{{0, std::nan(""), 0}}, tiles).error().field, "points[0]");
  const std::vector<Vec3> stroke = line({0, 0, 0}, {1, 0, 0});
  EXPECT_EQ(divide_stroke(stroke, tiles, {.reach_m = 0}).error().field, "reach_m");
  EXPECT_EQ(divide_stroke(stroke, tiles, {.hysteresis_m = std::nan("")}).error().field, "hysteresis_m");
  EXPECT_EQ(divide_stroke(stroke, tiles, {.samples = 1}).error().field, "samples");
}

TEST(StrokePartition, DistancesOutsideOfTheTrim) {
  const Superellipse circle = *Superellipse::create({{0.01, 0.02}, {0.1, 0.1}}, 2);
  const double rim = 0.1 * std::sqrt(trim_level());
  EXPECT_EQ(distance_outside(circle, {0.01, 0.02}), 0);
  EXPECT_EQ(distance_outside(circle, {0.01 + 0.99 * rim, 0.02}), 0);
  EXPECT_NEAR(distance_outside(circle, {0.01, 0.02 + 3 * rim}), 2 * rim, 1e-12);
}

}  // namespace
}  // namespace handloft::geometry
