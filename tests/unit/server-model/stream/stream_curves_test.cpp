// The boundary that trims a shape as a curve that viewers draw (A24).

#include "server-model/stream/curves.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <numbers>

#include "server-model/model/model.h"

namespace handloft::stream {
namespace {

class CurvesTest : public ::testing::Test {
 protected:
  void submit(const v1::Operation& operation) {
    const auto result = model_.submit(operation);
    ASSERT_TRUE(result.ok()) << result.error().describe();
  }
  void SetUp() override {
    v1::Operation operation;
    operation.mutable_add_points()->set_entity("shape");
    operation.mutable_add_points()->mutable_create();
    for (int i = -4; i <= 4; ++i) {
      for (int k = -4; k <= 4; ++k) {
        v1::Point& point = *operation.mutable_add_points()->add_points();
        point.mutable_position()->set_x(0.01 * i);
        point.mutable_position()->set_y(0.01 * k);
        point.mutable_position()->set_z(height(0.01 * i, 0.01 * k));
        point.set_pressure(1.0);
      }
    }
    submit(operation);
    v1::Operation fit;
    fit.mutable_fit()->set_entity("shape");
    submit(fit);
  }
  static double height(double x, double y) { return 0.1 + 2.0 * x * x - y * y; }
  /// A circle of `count` places that hangs above the surface.
  void trim(double radius_m, int count) {
    v1::Operation operation;
    operation.mutable_set_boundary()->set_entity("shape");
    for (int i = 0; i < count; ++i) {
      v1::Vec3& place = *operation.mutable_set_boundary()->add_curve();
      const double angle = 2 * std::numbers::pi * i / count;
      place.set_x(radius_m * std::cos(angle));
      place.set_y(radius_m * std::sin(angle));
      place.set_z(0.15);
    }
    submit(operation);
  }
  const model::DualShape& shape() { return *model_.document().find_dual("shape"); }
  static std::vector<geometry::Vec3> places(const v1::Polyline& line) {
    std::vector<geometry::Vec3> result;
    const std::string& bytes = line.points();
    for (std::size_t at = 0; at + 12 <= bytes.size(); at += 12) {
      geometry::Vec3 place;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          bits |= std::uint32_t{static_cast<std::uint8_t>(bytes[at + 4 * axis + k])} << (8U * k);
        }
        place[static_cast<Eigen::Index>(axis)] = double{std::bit_cast<float>(bits)};
      }
      result.push_back(place);
    }
    return result;
  }

  model::Model model_;
};

TEST_F(CurvesTest, A24_TheBoundaryIsSentOnTheSurfaceThatItTrims) {
  trim(0.025, 60);
  v1::EntityState state;
  write_curves(shape(), state);
  EXPECT_TRUE(state.curves_shown());
  ASSERT_EQ(state.curves_size(), 1);
  EXPECT_TRUE(state.curves(0).closed());
  EXPECT_EQ(state.curves(0).kind(), v1::Polyline::BOUNDARY);
  const auto drawn = places(state.curves(0));
  ASSERT_GE(drawn.size(), 60U);
  ASSERT_EQ(12 * drawn.size(), state.curves(0).points().size());
  for (const geometry::Vec3& place : drawn) {
    EXPECT_NEAR(std::hypot(place.x(), place.y()), 0.025, 1e-3);
    EXPECT_NEAR(place.z(), height(place.x(), place.y()), 1e-5) << "not where it was drawn, 5 cm above";
  }
}

TEST_F(CurvesTest, A22_WithoutABoundaryTheSetIsEmptyAndSaysSo) {
  v1::EntityState state;
  write_curves(shape(), state);
  EXPECT_TRUE(state.curves_shown()) << "so that a former boundary goes";
  EXPECT_EQ(state.curves_size(), 0);
  const model::DualShape unfitted;
  v1::EntityState other;
  write_curves(unfitted, other);
  EXPECT_TRUE(other.curves_shown());
  EXPECT_EQ(other.curves_size(), 0);
}

TEST_F(CurvesTest, A24_LongBoundariesAreThinned) {
  trim(0.025, 15000);
  v1::EntityState state;
  write_curves(shape(), state);
  ASSERT_EQ(state.curves_size(), 1);
  const auto drawn = places(state.curves(0));
  EXPECT_LE(drawn.size(), 2000U);
  EXPECT_GE(drawn.size(), 1000U);
  double longest = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    longest = std::max(longest, (drawn[(i + 1) % drawn.size()] - drawn[i]).norm());
  }
  EXPECT_LT(longest, 2e-3) << "and all the way round";
}

TEST_F(CurvesTest, CurvesDifferWhenBoundaryOrSurfaceDo) {
  const model::DualShape plain = shape();
  EXPECT_FALSE(curves_differ(nullptr, plain));
  EXPECT_FALSE(curves_differ(&plain, plain));
  trim(0.025, 60);
  const model::DualShape trimmed = shape();
  EXPECT_TRUE(curves_differ(nullptr, trimmed)) << "new to this viewer";
  EXPECT_TRUE(curves_differ(&plain, trimmed));
  EXPECT_TRUE(curves_differ(&trimmed, plain)) << "it has gone";
  EXPECT_FALSE(curves_differ(&trimmed, trimmed));
  v1::Operation fit;
  fit.mutable_fit()->set_entity("shape");
  fit.mutable_fit()->set_degree(1);
  submit(fit);
  EXPECT_TRUE(curves_differ(&trimmed, shape())) << "it lies on another surface";
  v1::Operation rename;
  rename.mutable_rename()->set_entity("shape");
  rename.mutable_rename()->set_name("other");
  const model::DualShape before = shape();
  submit(rename);
  EXPECT_FALSE(curves_differ(&before, shape()));
}

}  // namespace
}  // namespace handloft::stream
