// Trims of sculpted surfaces as polylines, where files let them stand out of the parameters.

#include "server-model/model/sculpt_place.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "server-model/geometry/knot_vector.h"

namespace handloft::model {
namespace {

using geometry::KnotVector;
using geometry::Vec2;
using geometry::Vec3;

/// A flat bilinear sheet, 2 m by 1 m, parameters in metres, whose trim is the square [-out, 1] x [0.2, 0.8].
SculptShape trimmed(double out) {
  geometry::BSplineSurface sheet{
      *KnotVector::open(1, {0, 0, 2, 2}), *KnotVector::open(1, {0, 0, 1, 1}), {}, {}};
  sheet.control = {Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(2, 0, 0), Vec3(2, 1, 0)};
  SculptShape shape;
  shape.id = "face";
  shape.initial = shape.rest = shape.surface = std::make_shared<const geometry::BSplineSurface>(sheet);
  const TrimSpline around{*KnotVector::open(1, {0, 0, 1, 2, 3, 4, 4}),
                          {{-out, 0.2}, {1, 0.2}, {1, 0.8}, {-out, 0.8}, {-out, 0.2}},
                          {}};
  shape.trim = std::make_shared<const FaceTrim>(FaceTrim{{around}});
  return shape;
}

// hammer.iges of occt-misc has four faces whose trims stand out by 4.5e-5 of the range.
TEST(SculptPlace, ATrimThatStandsOutByLittleEndsAtTheBorder) {
  const SculptShape shape = trimmed(2 * 4.5e-5);
  const auto loops = trim_loops(shape);
  ASSERT_EQ(loops.size(), 1U);
  ASSERT_EQ(loops[0].size(), 4U);
  EXPECT_EQ(loops[0][0], Vec2(0, 0.2));
  EXPECT_EQ(loops[0][1], Vec2(1, 0.2)) << "what is within stays";
  const auto hit = pick_sculpt(shape, {0.001, 0.5, 1}, {0, 0, -1});
  ASSERT_TRUE(hit.ok()) << hit.error().describe();
  ASSERT_TRUE(hit->has_value());
  EXPECT_NEAR((*hit)->uv.x(), 0.001, 1e-12);
  const auto beside = pick_sculpt(shape, {0.5, 0.1, 1}, {0, 0, -1});
  ASSERT_TRUE(beside.ok());
  EXPECT_FALSE(beside->has_value()) << "trimmed away";
}

TEST(SculptPlace, ATrimThatStandsOutByMoreIsRefusedNotBent) {
  const SculptShape shape = trimmed(0.1);
  EXPECT_EQ(trim_loops(shape)[0][0], Vec2(-0.1, 0.2));
  const auto hit = pick_sculpt(shape, {0.5, 0.5, 1}, {0, 0, -1});
  ASSERT_FALSE(hit.ok());
  EXPECT_EQ(hit.error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace handloft::model
