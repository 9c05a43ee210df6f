// A26, X3: what a CAD system finds in our STEP files, read back by Open CASCADE.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "server-model/exchange/step_reader.h"
#include "server-model/exchange/step_writer.h"
#include "tests/support/test_data.h"

namespace handloft::exchange {
namespace {

using geometry::PolynomialSurface;
using geometry::Superellipse;
using geometry::Vec2;
using geometry::Vec3;

constexpr double on_surface_m = 1e-6;  // metres
constexpr double tip_width_m = 1e-5;   // metres; where a star's arms end

SurfaceExport shell(double exponent, int degree, const std::string& name = "top") {
  SurfaceExport item;
  item.name = name;
  std::vector<double> c(static_cast<std::size_t>(geometry::coefficient_count(degree)));
  for (std::size_t k = 0; k < c.size(); ++k) c[k] = 0.012 * std::sin(1.0 + 2.0 * static_cast<double>(k));
  item.surface = *PolynomialSurface::from_scaled(degree, {{0.01, 0.02}, {0.06, 0.04}}, c);
  item.frame.rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  item.frame.origin = {0.1, -0.05, 0.2};
  item.superellipse = *Superellipse::create({{0.01, 0.02}, {0.06, 0.04}}, exponent);
  return item;
}

double distance_from(const SurfaceExport& item, const Vec3& world) {
  const Vec3 local = item.frame.to_local(world);
  return std::abs(local.z() - item.surface.value(local.x(), local.y()));
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream stream(path);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

class StepFile : public ::testing::Test {
 protected:
  StepContent round_trip(const std::vector<SurfaceExport>& items) {
    const Status written = write_step(path_, items);
    EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().describe());
    Result<StepContent> content = read_step(path_);
    EXPECT_TRUE(content.ok()) << (content.ok() ? "" : content.error().describe());
    return content.ok() ? *content : StepContent{};
  }
  test::TemporaryDirectory folder_;
  std::filesystem::path path_ = folder_.path() / "shape.step";
};

TEST_F(StepFile, A26_TrimmedFacesOfAllExponentsAreValidAndOnTheSurface) {
  for (const double n : {0.2, 0.3, 0.5, 1.0, 1.5, 2.0, 3.0, 8.0, 20.0}) {
    const SurfaceExport item = shell(n, 3);
    const StepContent content = round_trip({item});
    ASSERT_EQ(content.faces.size(), 1U) << n;
    const StepFace& face = content.faces[0];
    EXPECT_TRUE(content.valid) << n;
    EXPECT_TRUE(face.valid) << n;
    EXPECT_TRUE(face.is_bspline) << n;
    EXPECT_TRUE(face.has_pcurves) << n;
    EXPECT_EQ(face.degree_u, 3);
    EXPECT_GT(face.samples.size(), n < 0.5 ? 3U : 20U);  // A star covers little of its box.
    for (const Vec3& p : face.samples) {
      EXPECT_LE(distance_from(item, p), on_surface_m);
      const Vec3 local = item.frame.to_local(p);
      EXPECT_LE(item.superellipse.level(local.head<2>()), geometry::trim_level() * (1 + 1e-4));
    }
    ASSERT_GT(face.boundary.size(), 100U);
    for (const Vec3& p : face.boundary) {
      EXPECT_LE(distance_from(item, p), on_surface_m);
      const Vec2 xy = item.frame.to_local(p).head<2>();
      const Vec2 radial = xy - item.superellipse.centre();
      if (n < 1 && radial.cwiseAbs().minCoeff() <= 0.5 * tip_width_m * (1 + 1e-3)) continue;  // A tip's end.
      // On the half-opaque contour, to first order: |f - level| over the gradient is a length.
      const Vec2 unit = radial.cwiseAbs().cwiseQuotient(item.superellipse.half_extent());
      const Vec2 gradient = n * Vec2(std::pow(unit.x(), n - 1), std::pow(unit.y(), n - 1))
                                    .cwiseQuotient(item.superellipse.half_extent());
      const double off = std::abs(item.superellipse.level(xy) - geometry::trim_level());
      EXPECT_LE(off / gradient.norm(), 1e-6) << n;
    }
  }
}

TEST_F(StepFile, A22_A26_StarsMakeValidFacesOnSurfacesOfAllDegrees) {
  for (const double n : {0.2, 0.3, 0.5, 0.999}) {
    for (const int degree : {1, 3, 6}) {
      const SurfaceExport item = shell(n, degree);
      const StepContent content = round_trip({item});
      ASSERT_EQ(content.faces.size(), 1U) << n << " degree " << degree;
      EXPECT_TRUE(content.valid) << n << " degree " << degree;
      double worst = 0;
      for (const Vec3& p : content.faces[0].samples) worst = std::max(worst, distance_from(item, p));
      for (const Vec3& p : content.faces[0].boundary) worst = std::max(worst, distance_from(item, p));
      EXPECT_LE(worst, on_surface_m) << n << " degree " << degree;
    }
  }
}

// Only what is thinner than a tip may be missing of a star: that much of its area, and nothing of its middle.
TEST_F(StepFile, A22_A26_StarsOfAllSizesLoseOnlyTheirTips) {
  for (const double n : {0.2, 0.25, 0.4, 0.9}) {
    for (const Vec2& half : {Vec2(0.06, 0.04), Vec2(0.5, 0.5), Vec2(0.1, 1e-4), Vec2(0.001, 0.002)}) {
      SurfaceExport item = shell(n, 1);
      item.surface = PolynomialSurface{};
      item.superellipse = *Superellipse::create({{0.01, 0.02}, half}, n);
      const StepContent content = round_trip({item});
      ASSERT_EQ(content.faces.size(), 1U) << n << ", " << half.transpose();
      EXPECT_TRUE(content.valid) << n << ", " << half.transpose();
      const Vec2 extent = item.superellipse.contour_half_extent(geometry::trim_level());
      const double area = item.superellipse.area(geometry::trim_level());
      EXPECT_LE(content.faces[0].area_m2, area * (1 + 1e-6)) << n << ", " << half.transpose();
      EXPECT_GE(content.faces[0].area_m2, area * (1 - 1e-6) - 2 * tip_width_m * extent.sum())
          << n << ", " << half.transpose();
    }
  }
}

TEST_F(StepFile, A26_AreaOfAFlatFaceIsTheSuperellipses) {
  for (const double n : {1.0, 2.0, 4.0}) {
    SurfaceExport item = shell(n, 1);
    item.surface = PolynomialSurface{};
    const StepContent content = round_trip({item});
    ASSERT_EQ(content.faces.size(), 1U);
    const double area = item.superellipse.area(geometry::trim_level());
    EXPECT_NEAR(content.faces[0].area_m2 / area, 1, 1e-6) << n;
  }
}

TEST_F(StepFile, A26_UntrimmedOnRequest) {
  SurfaceExport item = shell(2, 2);
  item.surface = PolynomialSurface{};
  item.trim = Trim::box;
  const StepContent content = round_trip({item});
  ASSERT_EQ(content.faces.size(), 1U);
  EXPECT_TRUE(content.faces[0].valid);
  const Vec2 half = item.superellipse.contour_half_extent(geometry::trim_level());
  EXPECT_NEAR(content.faces[0].area_m2, 4 * half.x() * half.y(), 1e-9);
}

TEST_F(StepFile, NamesAndAllDegreesAreKept) {
  std::vector<SurfaceExport> items;
  for (int degree = 1; degree <= 6; ++degree)
    items.push_back(shell(2.5, degree, "part " + std::to_string(degree)));
  items[1].name = "it's a \\ \n mouse";
  const StepContent content = round_trip(items);
  ASSERT_EQ(content.faces.size(), 6U);
  EXPECT_TRUE(content.valid);
  EXPECT_EQ(content.faces[0].name, "part 1");
  EXPECT_EQ(content.faces[1].name, "it's a \\   mouse");
  EXPECT_EQ(content.faces[5].name, "part 6");
  for (std::size_t i = 0; i < 6; ++i) {
    for (const Vec3& p : content.faces[i].samples) EXPECT_LE(distance_from(items[i], p), on_surface_m) << i;
  }
}

TEST_F(StepFile, X1_X3_MillimetresAndParameterCurvesInTheText) {
  (void)round_trip({shell(2, 2)});
  const std::string text = text_of(path_);
  EXPECT_NE(text.find("SI_UNIT(.MILLI.,.METRE.)"), std::string::npos);
  EXPECT_NE(text.find("PCURVE("), std::string::npos);
  EXPECT_NE(text.find("B_SPLINE_SURFACE"), std::string::npos);
  EXPECT_NE(text.find("PRODUCT('top'"), std::string::npos);
}

TEST_F(StepFile, NothingIsPrinted) {
  testing::internal::CaptureStdout();
  (void)round_trip({shell(2, 2)});
  (void)read_step(folder_.path() / "none.step").ok();
  std::ofstream(folder_.path() / "bad.step") << "ISO-10303-21;\nHEADER;\nnonsense";
  (void)read_step(folder_.path() / "bad.step").ok();
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST_F(StepFile, BadInputIsRefusedAndTheOldFileStays) {
  std::ofstream(path_) << "old";
  EXPECT_EQ(write_step(path_, CadContent{}).error().field, "surfaces");
  std::vector<SurfaceExport> items{shell(2, 2), shell(2, 2)};
  items[1].frame.origin.x() = std::numeric_limits<double>::quiet_NaN();
  const Status status = write_step(path_, items);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().field.rfind("surfaces[1]", 0), 0U) << status.error().field;
  EXPECT_EQ(text_of(path_), "old");
}

TEST_F(StepFile, NotStepIsAnError) {
  EXPECT_EQ(read_step(path_).error().code, ErrorCode::not_found);
  std::ofstream(path_) << "hello";
  EXPECT_EQ(read_step(path_).error().code, ErrorCode::data_corrupt);
}

}  // namespace
}  // namespace handloft::exchange
