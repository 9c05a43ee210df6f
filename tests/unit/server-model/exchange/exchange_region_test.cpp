// A24, A26: faces trimmed by drawn curves, read back by Open CASCADE.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server-model/exchange/step_reader.h"
#include "server-model/exchange/step_writer.h"
#include "tests/support/test_data.h"

namespace handloft::exchange {
namespace {

using geometry::PolynomialSurface;
using geometry::Vec2;

/// Over z = x y / 2, and on a plane for areas by hand.
std::vector<SurfaceExport> faces_within(const std::vector<Vec2>& curve, double bend) {
  SurfaceExport item;
  item.name = "drawn";
  item.surface =
      *PolynomialSurface::from_coefficients(3, std::array{0.01, 0., 0., bend, 0., 0., 0., 0., bend, 0.});
  item.frame.origin = {0.1, 0.2, 0.3};
  item.trim = Trim::region;
  std::vector<SurfaceExport> items;
  const auto regions = geometry::planar_faces(curve);
  EXPECT_TRUE(regions.ok());
  if (!regions.ok()) return items;
  for (const auto& region : *regions) {
    items.push_back(item);
    items.back().region = region;
  }
  return items;
}

StepContent round_trip(const std::vector<SurfaceExport>& items) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "shape.step";
  const Status written = write_step(path, items);
  EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().describe());
  Result<StepContent> content = read_step(path);
  EXPECT_TRUE(content.ok()) << (content.ok() ? "" : content.error().describe());
  return content.ok() ? *content : StepContent{};
}

TEST(RegionFace, A24_A26_ADrawnCurveTrimsAValidFaceOfItsArea) {
  std::vector<Vec2> curve;
  for (int i = 0; i < 150; ++i) {
    const double angle = 2 * std::numbers::pi * i / 150;
    const double radius = 0.05 * (1 + 0.2 * std::cos(3 * angle));
    curve.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  const auto flat = faces_within(curve, 0);
  ASSERT_EQ(flat.size(), 1U);
  const StepContent plane = round_trip(flat);
  ASSERT_EQ(plane.faces.size(), 1U);
  EXPECT_TRUE(plane.valid);
  EXPECT_TRUE(plane.faces[0].has_pcurves);
  EXPECT_NEAR(plane.faces[0].area_m2, flat[0].region.area(), 1e-9);
  // r = a (1 + e cos 3t): area pi a^2 (1 + e^2 / 2), less the tolerance.
  EXPECT_NEAR(plane.faces[0].area_m2, std::numbers::pi * 0.0025 * 1.02, 1e-5);

  const auto bent = faces_within(curve, 0.5);
  const StepContent content = round_trip(bent);
  ASSERT_EQ(content.faces.size(), 1U);
  EXPECT_TRUE(content.faces[0].valid);
  for (const auto& points : {content.faces[0].boundary, content.faces[0].samples}) {
    EXPECT_GT(points.size(), 20U);
    for (const auto& p : points) {
      const auto local = bent[0].frame.to_local(p);
      EXPECT_NEAR(local.z(), bent[0].surface.value(local.x(), local.y()), 1e-8);
    }
  }
}

TEST(RegionFace, A24_A26_AFigureOfEightMakesTwoFaces) {
  const auto items = faces_within({{-0.05, -0.03}, {0.05, 0.03}, {0.05, -0.03}, {-0.05, 0.03}}, 0);
  ASSERT_EQ(items.size(), 2U);
  const StepContent content = round_trip(items);
  ASSERT_EQ(content.faces.size(), 2U);
  EXPECT_TRUE(content.valid);
  for (const StepFace& face : content.faces) EXPECT_NEAR(face.area_m2, 0.05 * 0.06 / 2, 1e-9);
}

TEST(RegionFace, A24_A26_ACurlIsAHoleThatTouches) {
  // Gone round twice: the inner square is outside by the even-odd rule.
  const auto items = faces_within({{0, 0},
                                   {0.08, 0},
                                   {0.08, 0.08},
                                   {0, 0.08},
                                   {0, 0},
                                   {0.02, 0.01},
                                   {0.06, 0.01},
                                   {0.06, 0.06},
                                   {0.01, 0.06}},
                                  0);
  ASSERT_FALSE(items.empty());
  double expected = 0;
  for (const auto& item : items) expected += item.region.area();
  const StepContent content = round_trip(items);
  double area = 0;
  for (const StepFace& face : content.faces) area += face.area_m2;
  EXPECT_TRUE(content.valid);
  EXPECT_NEAR(area, expected, 1e-9);
}

TEST(RegionFace, A26_UntrimmedIsTheBoxAroundTheCurve) {
  auto items = faces_within({{-0.05, -0.03}, {0.05, 0.03}, {0.03, 0.05}}, 0);
  ASSERT_EQ(items.size(), 1U);
  items[0].trim = Trim::box;
  const StepContent content = round_trip(items);
  ASSERT_EQ(content.faces.size(), 1U);
  EXPECT_NEAR(content.faces[0].area_m2, 0.1 * 0.08, 1e-9);
}

}  // namespace
}  // namespace handloft::exchange
