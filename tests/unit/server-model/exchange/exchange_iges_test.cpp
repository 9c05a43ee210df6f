// X3: what a CAD system finds in our IGES files, read back by Open CASCADE.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "server-model/exchange/iges_writer.h"
#include "server-model/exchange/step_reader.h"
#include "tests/support/test_data.h"

namespace handloft::exchange {
namespace {

using geometry::Vec3;

constexpr double on_surface_m = 1e-6;  // metres

SurfaceExport shell(double exponent, int degree, const std::string& name = "top") {
  SurfaceExport item;
  item.name = name;
  std::vector<double> c(static_cast<std::size_t>(geometry::coefficient_count(degree)));
  for (std::size_t k = 0; k < c.size(); ++k) c[k] = 0.012 * std::sin(1.0 + 2.0 * static_cast<double>(k));
  item.surface = *geometry::PolynomialSurface::from_scaled(degree, {{0.01, 0.02}, {0.06, 0.04}}, c);
  item.frame.rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  item.frame.origin = {0.1, -0.05, 0.2};
  item.superellipse = *geometry::Superellipse::create({{0.01, 0.02}, {0.06, 0.04}}, exponent);
  return item;
}

class IgesFile : public ::testing::Test {
 protected:
  StepContent round_trip(const std::vector<SurfaceExport>& items) {
    const Status written = write_iges(path_, items);
    EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().describe());
    Result<StepContent> content = read_iges(path_);
    EXPECT_TRUE(content.ok()) << (content.ok() ? "" : content.error().describe());
    return content.ok() ? *content : StepContent{};
  }
  std::string text() const {
    std::ifstream stream(path_);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  test::TemporaryDirectory folder_;
  std::filesystem::path path_ = folder_.path() / "shape.igs";
};

TEST_F(IgesFile, X3_TrimmedFacesAreBSplinesOnTheSurface) {
  for (const double n : {0.5, 1.0, 2.0, 8.0}) {
    for (const int degree : {1, 3, 6}) {
      const SurfaceExport item = shell(n, degree);
      const StepContent content = round_trip({item});
      ASSERT_EQ(content.faces.size(), 1U) << n;
      const StepFace& face = content.faces[0];
      EXPECT_TRUE(face.valid) << n << " degree " << degree;
      EXPECT_TRUE(face.is_bspline) << n;
      EXPECT_TRUE(face.has_pcurves) << n;
      EXPECT_EQ(face.degree_u, degree);
      EXPECT_GT(face.samples.size(), 10U);
      for (const auto* points : {&face.samples, &face.boundary}) {
        for (const Vec3& p : *points) {
          const Vec3 local = item.frame.to_local(p);
          ASSERT_NEAR(local.z(), item.surface.value(local.x(), local.y()), on_surface_m) << n;
          ASSERT_LE(item.superellipse.level(local.head<2>()), geometry::trim_level() * (1 + 1e-4)) << n;
        }
      }
    }
  }
}

TEST_F(IgesFile, X3_AreaUntrimmedAndTrimmed) {
  SurfaceExport item = shell(2, 1);
  item.surface = geometry::PolynomialSurface{};
  StepContent content = round_trip({item});
  ASSERT_EQ(content.faces.size(), 1U);
  EXPECT_NEAR(content.faces[0].area_m2 / item.superellipse.area(geometry::trim_level()), 1, 1e-6);
  item.trim = Trim::box;
  content = round_trip({item});
  ASSERT_EQ(content.faces.size(), 1U);
  const geometry::Vec2 half = item.superellipse.contour_half_extent(geometry::trim_level());
  EXPECT_NEAR(content.faces[0].area_m2, 4 * half.x() * half.y(), 1e-9);
}

TEST_F(IgesFile, X1_X3_MillimetresTrimmedSurfacesAndLabels) {
  const StepContent content = round_trip({shell(2, 2, "top"), shell(2, 3, "Rückenlehne")});
  ASSERT_EQ(content.faces.size(), 2U);
  EXPECT_EQ(content.faces[0].name, "top");
  EXPECT_EQ(content.faces[1].name, "R_ckenle");  // Eight characters of the name, in ASCII.
  const std::string file = text();
  EXPECT_NE(file.find("2HMM"), std::string::npos);
  EXPECT_NE(file.find("8HHandloft"), std::string::npos);
  EXPECT_NE(file.find("\n144,"), std::string::npos);  // A trimmed surface.
  EXPECT_EQ(file.find("\n186,"), std::string::npos);
}

TEST_F(IgesFile, NothingIsPrintedAndBadInputKeepsTheOldFile) {
  std::ofstream(path_) << "old";
  testing::internal::CaptureStdout();
  EXPECT_EQ(write_iges(path_, CadContent{}).error().field, "surfaces");
  std::vector<SurfaceExport> items{shell(2, 2), shell(2, 2)};
  items[1].frame.origin.x() = std::numeric_limits<double>::quiet_NaN();
  const Status status = write_iges(path_, items);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().field.rfind("surfaces[1]", 0), 0U) << status.error().field;
  EXPECT_EQ(text(), "old");
  EXPECT_EQ(read_iges(path_).error().code, ErrorCode::data_corrupt);
  EXPECT_EQ(read_iges(folder_.path() / "none.igs").error().code, ErrorCode::not_found);
  (void)round_trip({shell(2, 2)});
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

}  // namespace
}  // namespace handloft::exchange
