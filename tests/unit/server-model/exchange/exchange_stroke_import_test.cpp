#include "server-model/exchange/stroke_import.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/test_data.h"

namespace handloft::exchange {
namespace {

using geometry::Vec3;

codec::TiltFile two_points() {
  codec::TiltFile file;
  file.strokes.resize(1);
  file.strokes[0].points.resize(2);
  file.strokes[0].points[0] = {{1, 2, 3}, {0, 0, 0, 1}, 0.25F, 5000};
  file.strokes[0].points[1] = {{3, 2, 4}, {0, 0, 0, 1}, 1.0F, 5500};
  return file;
}

TEST(StrokeImport, ScalesTurnsAndShifts) {
  StrokePlacement placement;
  placement.scale_m_per_unit = 0.1;
  placement.translation = {0, 0, 1};
  const auto strokes = import_strokes(two_points(), placement);
  ASSERT_TRUE(strokes.ok());
  const auto& points = strokes->strokes[0].points;
  EXPECT_LE((points[0].position - Vec3(0.1, 0.3, 1.2)).norm(), 1e-15) << "y is up in the file, z is up here";
  EXPECT_EQ(points[0].pressure, 0.25);
  EXPECT_EQ(points[0].time_s, 0);
  EXPECT_DOUBLE_EQ(points[1].time_s, 0.5);
  EXPECT_EQ(strokes->point_count, 2U);
  EXPECT_LE((strokes->upper - Vec3(0.3, 0.4, 1.2)).norm(), 1e-15);
}

TEST(StrokeImport, PlacementFillsTheBox) {
  const Vec3 lower(-0.1, -0.1, 0.02);
  const Vec3 upper(0.1, 0.1, 0.5);
  const auto placement = placement_into(two_points(), lower, upper);
  ASSERT_TRUE(placement.ok());
  const auto strokes = import_strokes(two_points(), *placement);
  EXPECT_NEAR(strokes->lower.x(), -0.1, 1e-15);
  EXPECT_NEAR(strokes->upper.x(), 0.1, 1e-15);
  EXPECT_NEAR(strokes->lower.z(), 0.02, 1e-15);
  EXPECT_NEAR(strokes->lower.y() + strokes->upper.y(), 0, 1e-15);
}

TEST(StrokeImport, BadInputIsRefused) {
  StrokePlacement placement;
  placement.scale_m_per_unit = 0;
  EXPECT_EQ(import_strokes(two_points(), placement).error().field, "scale");
  placement = {};
  placement.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(import_strokes(two_points(), placement).error().field, "placement");
  EXPECT_EQ(placement_into({}, Vec3::Zero(), Vec3::Ones()).error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(placement_into(two_points(), Vec3::Ones(), Vec3::Zero()).error().field, "box");
}

TEST(StrokeImport, RealStrokesArriveWithTheirPressureInOrder) {
  HANDLOFT_REQUIRE_DATA(path, "tilt/torch.tilt");
  const auto file = codec::read_tilt_file(path);
  ASSERT_TRUE(file.ok());
  const Vec3 lower(-0.15, -0.15, 0);
  const Vec3 upper(0.15, 0.15, 0.3);
  const auto strokes = import_strokes(*file, *placement_into(*file, lower, upper));
  ASSERT_TRUE(strokes.ok());
  EXPECT_EQ(strokes->point_count, 681U);
  EXPECT_GE((strokes->lower - lower).minCoeff(), -1e-12);
  EXPECT_LE((strokes->upper - upper).maxCoeff(), 1e-12);
  for (std::size_t s = 0; s < strokes->strokes.size(); ++s) {
    for (std::size_t i = 0; i < strokes->strokes[s].points.size(); ++i) {
      EXPECT_EQ(strokes->strokes[s].points[i].pressure,
                static_cast<double>(file->strokes[s].points[i].pressure));
    }
  }
}

}  // namespace
}  // namespace handloft::exchange
