// The sculpted surface as a thin plate against the plate formulas of mechanics (D3 to D5).

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/server-model/geometry/sculpt_shapes.h"

namespace handloft::geometry {
namespace {

// The deflection of unit square plates with D = 1 under a uniform pressure of 1, at the centre
// (Timoshenko and Woinowsky-Krieger, tables 8 and 35, with the digits that their series give).
constexpr double supported_centre = 0.004062352661;
constexpr double clamped_centre = 0.00126532;

SculptSetup plate(Support support) {
  SculptSetup setup;
  setup.energy.a11 = setup.energy.a22 = 0;
  setup.supports = {support, support, support, support};
  return setup;
}

// A pressure of 1 along z: its right-hand side is the integral of the functions. The energy is
// x^T K x - 2 x^T F, so that K x = F is D times the biharmonic equation with D = 1.
std::vector<SculptLoad> pressure(const BSplineSurface& surface) {
  std::vector<SculptLoad> loads;
  const Eigen::VectorXd u = gram_matrix(surface.u, 0, 0) * Eigen::VectorXd::Ones(surface.u.control_count());
  const Eigen::VectorXd v = gram_matrix(surface.v, 0, 0) * Eigen::VectorXd::Ones(surface.v.control_count());
  SurfaceFunctional all;
  for (Eigen::Index i = 0; i < u.size(); ++i)
    for (Eigen::Index j = 0; j < v.size(); ++j) {
      all.point.push_back(static_cast<std::uint32_t>(i * v.size() + j));
      all.value.push_back(u[i] * v[j]);
    }
  return {{all, Vec3::UnitZ()}};
}

double centre_deflection(int spans, Support support, const std::vector<SculptLoad>* loads = nullptr) {
  const BSplineSurface flat = flat_surface(3, spans + 3, spans + 3);
  SculptSystem system = SculptSystem::create(flat, plate(support)).value();
  const SculptSolution solution =
      system.solve({}, loads != nullptr ? *loads : pressure(flat), ConflictPolicy::refuse).value();
  EXPECT_LE(system.residual({}, loads != nullptr ? *loads : pressure(flat), solution).stationarity, 1e-10);
  return with_control(flat, solution.control).evaluate(0.5, 0.5).z();
}

TEST(Plate, SimplySupportedSquareConvergesWithFourthOrderOrBetter) {  // D3: table over 8, 16, 32 spans
  const double at_8 = centre_deflection(8, Support::supported);
  const double at_16 = centre_deflection(16, Support::supported);
  const double at_32 = centre_deflection(32, Support::supported);
  EXPECT_NEAR(at_8, 0.004062507, 1e-9);
  EXPECT_NEAR(at_32, 0.004062353, 1e-9);
  EXPECT_NEAR(at_32, supported_centre, 2e-9);
  const double error_8 = std::abs(at_8 - supported_centre);
  const double error_16 = std::abs(at_16 - supported_centre);
  const double error_32 = std::abs(at_32 - supported_centre);
  EXPECT_GT(std::log2(error_8 / error_16), 3.7);
  EXPECT_GT(std::log2(error_16 / error_32), 3.7);
}

TEST(Plate, ClampedSquareDeflectsAsTabulated) {  // D3
  EXPECT_NEAR(centre_deflection(8, Support::clamped), 0.001265146, 1e-9);
  EXPECT_NEAR(centre_deflection(32, Support::clamped), 0.001265318, 1e-9);
  EXPECT_NEAR(centre_deflection(32, Support::clamped), clamped_centre, 5e-9);
}

TEST(Plate, PointLoadAtTheCentreDeflectsAsTabulated) {  // D5: 0.0116008 P a^2 / D within 1 %
  const BSplineSurface flat = flat_surface(3, 35, 35);
  const std::vector<SculptLoad> load{point_load(flat, {0.5, 0.5}, Vec3::UnitZ()).value()};
  EXPECT_NEAR(centre_deflection(32, Support::supported, &load), 0.0116008, 0.01 * 0.0116008);
}

TEST(Plate, AbsoluteModeFairsToThePlateOfTheBorder) {  // D4: the shape is the plate's, the bump is gone
  BSplineSurface bumpy = flat_surface(3, 19, 19);
  const std::vector<SculptLoad> load = pressure(bumpy);
  SculptSetup setup = plate(Support::supported);
  const SculptSolution flat_answer =
      SculptSystem::create(bumpy, setup).value().solve({}, load, ConflictPolicy::refuse).value();
  bumpy.control[bumpy.index(9, 9)].z() = 0.001;  // Hardly changes the mean length of rows.
  setup.mode = SculptMode::absolute_fairing;
  SculptSystem system = SculptSystem::create(bumpy, setup).value();
  const SculptSolution faired = system.solve({}, load, ConflictPolicy::refuse).value();
  EXPECT_LE(largest_difference(faired.control, flat_answer.control), 1e-8);
  EXPECT_LE(system.residual({}, load, faired).stationarity, 1e-10);
}

TEST(Plate, ScaledParametersMakeLargePlatesSofter) {  // D2: a^2 / D: the domain is the length, not 0..1
  const auto compliance = [](double size) -> double {
    BSplineSurface flat = flat_surface(3, 19, 19);
    for (Vec3& point : flat.control) point *= size;
    SculptSystem system = SculptSystem::create(flat, plate(Support::supported)).value();
    const std::vector<SculptLoad> load{point_load(flat, {0.5, 0.5}, Vec3::UnitZ()).value()};
    return system.compliance({}, load).value();
  };
  EXPECT_NEAR(compliance(3) / compliance(1), 9, 1e-9);
}

}  // namespace
}  // namespace handloft::geometry
