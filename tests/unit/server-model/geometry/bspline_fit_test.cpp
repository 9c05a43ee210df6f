#include "server-model/geometry/bspline_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "bspline_samples.h"
#include "server-model/geometry/bspline_conversion.h"

namespace handloft::geometry {
namespace {

using samples::Kind;
using samples::Random;
using samples::Weights;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double pi = std::numbers::pi;

/// A hood: 1.2 m x 0.8 m, 0.1 m high, with a crease of 20 mm.
Vec3 hood(double u, double v) {
  return {1.2 * u, 0.8 * v, 0.1 * std::sin(pi * u) * std::sin(pi * v) + 0.02 * std::tanh(8 * (v - 0.5))};
}

struct GridData {
  std::vector<Vec3> points;
  PointGrid grid;
};

template <typename Shape>
GridData grid_of(std::size_t rows, std::size_t columns, const Shape& shape) {
  GridData data;
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      data.points.push_back(shape(static_cast<double>(r) / static_cast<double>(rows - 1),
                                  static_cast<double>(c) / static_cast<double>(columns - 1)));
    }
  }
  data.grid = {rows, columns, data.points};
  return data;
}

TEST(BSplineFit, ChordParametersOfTheNurbsBook) {
  // Piegl and Tiller, Ex9.1: {(0,0),(3,4),(-1,4),(-4,0),(-4,-3)}, degree 3: u = {0, 5/17, 9/17, 14/17, 1};
  // the inner knot is 28/51.
  const std::vector<Vec3> points = {{0, 0, 0}, {3, 4, 0}, {-1, 4, 0}, {-4, 0, 0}, {-4, -3, 0}};
  const auto parameters = chord_parameters(points);
  ASSERT_TRUE(parameters.ok());
  const std::vector<double> expected = {0, 5.0 / 17, 9.0 / 17, 14.0 / 17, 1};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_DOUBLE_EQ((*parameters)[i], expected[i]);
  const auto curve = interpolate_curve(points, 3);
  ASSERT_TRUE(curve.ok());
  EXPECT_DOUBLE_EQ(curve->knots.knots()[4], 28.0 / 51);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_LT((curve->evaluate(expected[i]) - points[i]).norm(), 1e-14) << i;
  }
}

TEST(BSplineFit, CurvesInterpolateAtAnyDegree) {
  Random random(1);
  for (const int degree : {1, 2, 3, 5, 8}) {
    std::vector<Vec3> points;
    for (int i = 0; i < 30; ++i) {
      points.emplace_back(0.1 * i, std::sin(0.4 * i), samples::uniform(random, 0, 0.1));
      if (i == 7) points.push_back(points.back());
    }
    const auto curve = interpolate_curve(points, degree);
    ASSERT_TRUE(curve.ok()) << curve.error().describe();
    EXPECT_EQ(curve->control.size(), 30U);
    points.erase(points.begin() + 7);
    const auto parameters = chord_parameters(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_LT((curve->evaluate((*parameters)[i]) - points[i]).norm(), 1e-12);
    }
  }
}

TEST(BSplineFit, CurvesComeAsNearAsAsked) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 400; ++i) {
    const double t = 2 * pi * i / 400;
    points.emplace_back(std::cos(t), std::sin(t), 0.1 * std::sin(5 * t));
  }
  std::size_t fewer = 0;
  for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
    const auto fit = approximate_curve(points, {.tolerance_m = tolerance});
    ASSERT_TRUE(fit.ok());
    EXPECT_TRUE(fit->within_tolerance);
    EXPECT_LE(fit->error.max_m, tolerance);
    EXPECT_LE(fit->error.rms_m, fit->error.max_m);
    EXPECT_GT(fit->curve.control.size(), fewer);
    EXPECT_LT(fit->curve.control.size(), points.size());
    fewer = fit->curve.control.size();
    EXPECT_EQ(fit->curve.control.front(), points.front());
    EXPECT_EQ(fit->curve.control.back(), points.back());
  }
  // The cap holds, and what it costs is said.
  const auto capped = approximate_curve(points, {.tolerance_m = 1e-6, .max_control_points = 12});
  ASSERT_TRUE(capped.ok());
  EXPECT_FALSE(capped->within_tolerance);
  EXPECT_LE(capped->curve.control.size(), 12U);
  EXPECT_GT(capped->error.max_m, 1e-6);
}

TEST(BSplineFit, LengthParametersRunAtUnitSpeed) {
  const BSplineCurve circle = samples::circle();
  const auto fit = by_length(circle, {.tolerance_m = 1e-8});
  ASSERT_TRUE(fit.ok()) << fit.error().describe();
  EXPECT_TRUE(fit->within_tolerance);
  EXPECT_FALSE(fit->curve.is_rational());
  EXPECT_NEAR(fit->curve.knots.upper(), 2 * pi, 1e-12);
  for (int i = 0; i <= 500; ++i) {
    const double s = 2 * pi * i / 500;
    EXPECT_LT((fit->curve.evaluate(s) - Vec3(std::cos(s), std::sin(s), 0)).norm(), 2e-8);
    EXPECT_NEAR(fit->curve.derivatives(s, 1)[1].norm(), 1, 1e-5);
  }
}

TEST(BSplineFit, LengthParametersKeepCorners) {
  // Two legs, badly parametrised: speed from 0.2 to 1.8.
  const BSplineCurve corner{KnotVector::open(2, {0, 0, 0, 1, 1, 2, 2, 2}).value(),
                            {{0, 0, 0}, {0.1, 0, 0}, {1, 0, 0}, {1, 0.1, 0}, {1, 1, 0}},
                            {}};
  const auto fit = by_length(corner, {.tolerance_m = 1e-6});
  ASSERT_TRUE(fit.ok()) << fit.error().describe();
  EXPECT_TRUE(fit->within_tolerance);
  EXPECT_LT((fit->curve.evaluate(1) - Vec3(1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((fit->curve.evaluate(1.5) - Vec3(1, 0.5, 0)).norm(), 2e-6);
  Random random(3);
  for (const Kind kind : samples::kinds) {
    const auto other =
        by_length(samples::random_curve(random, kind, 3, Weights::random), {.tolerance_m = 1e-4});
    ASSERT_TRUE(other.ok());
    EXPECT_TRUE(other->within_tolerance) << other->error.max_m;
  }
}

TEST(BSplineFit, GridsAreInterpolated) {
  const GridData data = grid_of(17, 23, hood);
  for (const int degree : {1, 3, 4}) {
    const auto surface = interpolate_grid(data.grid, degree, 3);
    ASSERT_TRUE(surface.ok()) << surface.error().describe();
    ASSERT_TRUE(check(*surface).ok());
    EXPECT_EQ(surface->u.control_count(), 17);
    EXPECT_EQ(surface->v.control_count(), 23);
    // Corners to the bit; all points at the mean chord parameters.
    EXPECT_EQ(surface->at(0, 0), data.points.front());
    EXPECT_EQ(surface->at(16, 22), data.points.back());
    for (std::size_t i = 0; i < data.points.size(); i += 7) {
      double nearest = 1;
      for (int a = 0; a <= 160; ++a) {
        for (int b = 0; b <= 10; ++b) {
          nearest = std::min(nearest, (surface->evaluate(a / 160.0, b / 10.0) - data.points[i]).norm());
        }
      }
      EXPECT_LT(nearest, 0.08);
    }
  }
  // The error says it exactly: as many control points as points leave none.
  const auto fit = approximate_grid(data.grid, {.tolerance_m = 1e-12});
  ASSERT_TRUE(fit.ok());
  EXPECT_TRUE(fit->within_tolerance) << fit->error.max_m;
}

TEST(BSplineFit, GridsWithAPoleInterpolate) {
  const GridData cone =
      grid_of(9, 12, [](double u, double v) { return Vec3(u * std::cos(v), u * std::sin(v), 1 - u); });
  const auto surface = interpolate_grid(cone.grid, 3, 3);
  ASSERT_TRUE(surface.ok()) << surface.error().describe();
  EXPECT_LT((surface->evaluate(0, 0.4) - Vec3(0, 0, 1)).norm(), 1e-14);
}

TEST(BSplineFit, GridsComeAsNearAsAsked) {
  const GridData data = grid_of(90, 70, hood);
  const auto fit = approximate_grid(data.grid, {.tolerance_m = 1e-5});
  ASSERT_TRUE(fit.ok()) << fit.error().describe();
  EXPECT_TRUE(fit->within_tolerance);
  EXPECT_LE(fit->error.max_m, 1e-5);
  EXPECT_LT(fit->surface.control.size(), 1000U);
  // The crease runs along u: v needs more.
  EXPECT_GT(fit->surface.v.control_count(), fit->surface.u.control_count());
  const auto capped = approximate_grid(data.grid, {.tolerance_m = 1e-9, .max_control_points = 100});
  ASSERT_TRUE(capped.ok());
  EXPECT_LE(capped->surface.control.size(), 100U);
  EXPECT_FALSE(capped->within_tolerance);
}

TEST(BSplineFit, OfASplinesOwnPointsNothingIsLost) {
  // A control: the error of what can be represented is rounding, and the degree of the data suffices.
  Random random(5);
  const BSplineSurface truth = {KnotVector::uniform(3, 4).value(),
                                KnotVector::uniform(3, 4).value(),
                                [&] {
                                  std::vector<Vec3> control;
                                  for (int i = 0; i < 4; ++i) {
                                    for (int j = 0; j < 4; ++j) {
                                      control.emplace_back(i / 3.0, j / 3.0,
                                                           samples::uniform(random, 0, 0.3));
                                    }
                                  }
                                  return control;
                                }(),
                                {}};
  std::vector<SurfaceSample> points;
  for (int i = 0; i < 400; ++i) {
    const Vec2 uv(samples::uniform(random, 0, 1), samples::uniform(random, 0, 1));
    points.push_back({truth.evaluate(uv.x(), uv.y()), uv, samples::uniform(random, 0.1, 1)});
  }
  const auto fit =
      approximate_points(points, {.tolerance_m = 1e-9, .smoothing = 1e-16, .parameter_corrections = 0});
  ASSERT_TRUE(fit.ok()) << fit.error().describe();
  EXPECT_TRUE(fit->within_tolerance) << fit->error.max_m;
  EXPECT_EQ(fit->surface.control.size(), 16U);
}

TEST(BSplineFit, PointsAnywhereComeAsNearAsAsked) {
  Random random(6);
  std::vector<Vec3> places;
  for (int i = 0; i < 3000; ++i)
    places.push_back(hood(samples::uniform(random, 0, 1), samples::uniform(random, 0, 1)));
  Frame frame;
  frame.rotation = Eigen::AngleAxisd(0.2, Vec3(1, 1, 0).normalized()).toRotationMatrix();
  const auto fit = approximate_points(projected_on(frame, places), {.tolerance_m = 2e-4});
  ASSERT_TRUE(fit.ok()) << fit.error().describe();
  EXPECT_TRUE(fit->within_tolerance) << fit->error.max_m << " with " << fit->surface.control.size();
  EXPECT_LT(fit->surface.control.size(), 1500U);
  // The stated error is the truth: each point lies so near.
  for (std::size_t i = 0; i < places.size(); i += 100) {
    const auto again = projected_on(fit->surface, std::span(places).subspan(i, 1));
    ASSERT_TRUE(again.ok());
    const Vec2 uv = again->front().uv;
    EXPECT_LE((fit->surface.evaluate(uv.x(), uv.y()) - places[i]).norm(), fit->error.max_m + 1e-12);
  }
}

TEST(BSplineFit, PointsRoundASurfaceTakeItsParameters) {
  // A half cylinder's bumps, which no plane has as a height field.
  const GridData cylinder = grid_of(
      12, 25, [](double u, double v) { return Vec3(u, 0.3 * std::cos(pi * v), 0.3 * std::sin(pi * v)); });
  const auto base = interpolate_grid(cylinder.grid, 3, 3);
  ASSERT_TRUE(base.ok());
  Random random(7);
  std::vector<Vec3> places;
  for (int i = 0; i < 1500; ++i) {
    const double u = samples::uniform(random, 0, 1), v = samples::uniform(random, 0, 1);
    const double r = 0.3 + 0.01 * std::sin(2 * pi * u) * std::sin(pi * v);
    places.emplace_back(u, r * std::cos(pi * v), r * std::sin(pi * v));
  }
  const auto on_base = projected_on(*base, places);
  ASSERT_TRUE(on_base.ok());
  const auto fit = approximate_points(*on_base, {.tolerance_m = 2e-4});
  ASSERT_TRUE(fit.ok());
  EXPECT_TRUE(fit->within_tolerance) << fit->error.max_m;
}

TEST(BSplineFit, HolesAreBridgedSmoothly) {
  Random random(8);
  std::vector<Vec3> places;
  for (int i = 0; i < 3000; ++i) {
    const double u = samples::uniform(random, -1, 1), v = samples::uniform(random, -1, 1);
    if (u * u + v * v > 0.2) places.emplace_back(u, v, 0.1 * u * u);
  }
  const auto fit = approximate_points(projected_on(Frame{}, places),
                                      {.tolerance_m = 1e-4, .first_spans_u = 12, .first_spans_v = 12});
  ASSERT_TRUE(fit.ok());
  EXPECT_TRUE(fit->within_tolerance);
  EXPECT_NEAR(fit->surface.evaluate(0, 0).z(), 0, 0.02);
}

TEST(BSplineFit, MeshesWeighByArea) {
  std::vector<SurfaceSample> vertices =
      projected_on(Frame{}, std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {5, 5, 5}});
  const std::vector<std::uint32_t> indices = {0, 1, 2, 0, 2, 3};
  ASSERT_TRUE(weigh_by_area(indices, vertices).ok());
  EXPECT_DOUBLE_EQ(vertices[0].weight, 1.0 / 3);
  EXPECT_DOUBLE_EQ(vertices[1].weight, 1.0 / 6);
  EXPECT_EQ(vertices[4].weight, 0);
  EXPECT_EQ(weigh_by_area(std::vector<std::uint32_t>{0, 1}, vertices).error().field, "indices");
  EXPECT_EQ(weigh_by_area(std::vector<std::uint32_t>{0, 1, 5}, vertices).error().field, "indices[2]");
}

TEST(BSplineFit, PolynomialShapesConvertExactly) {
  Random random(9);
  Frame frame;
  frame.origin = {0.3, -0.2, 0.1};
  frame.rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Box2 box{{0.02, -0.05}, {0.2, 0.1}};
  for (int degree = min_degree; degree <= max_degree; ++degree) {
    std::vector<double> c(static_cast<std::size_t>(coefficient_count(degree)));
    for (double& x : c) x = samples::uniform(random, -0.05, 0.05);
    const auto shape = PolynomialSurface::from_scaled(degree, Box2{{0.01, 0}, {0.15, 0.12}}, c);
    ASSERT_TRUE(shape.ok());
    const auto surface = to_bspline_surface(*shape, frame, box);
    ASSERT_TRUE(surface.ok()) << surface.error().describe();
    EXPECT_EQ(surface->u.degree(), degree);
    for (int i = 0; i <= 10; ++i) {
      for (int j = 0; j <= 10; ++j) {
        const double x = box.lower().x() + 0.04 * i;
        const double y = box.lower().y() + 0.02 * j;
        EXPECT_LT((surface->evaluate(x, y) - shape->world_point(frame, x, y)).norm(), 1e-14);
      }
    }
  }
  EXPECT_EQ(to_bspline_surface(PolynomialSurface{}, frame, Box2{}).error().field, "box");
  EXPECT_EQ(to_bspline_surface(PolynomialSurface{}, frame, Box2{{1e9, 0}, {1e-9, 1}}).error().field, "box");
}

TEST(BSplineFit, BadPointsAreRefused) {
  const std::vector<Vec3> same(5, Vec3(1, 1, 1));
  std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {2, 1, 0}, {3, 0, 0}, {4, 4, 4}};
  EXPECT_FALSE(chord_parameters(same).ok());
  EXPECT_FALSE(chord_parameters(std::span(points).first(1)).ok());
  EXPECT_FALSE(interpolate_curve(same, 3).ok());
  EXPECT_FALSE(interpolate_curve(points, 5).ok());
  EXPECT_FALSE(interpolate_curve(points, 0).ok());
  EXPECT_FALSE(interpolate_curve({}, 3).ok());
  EXPECT_FALSE(approximate_curve(same).ok());
  EXPECT_FALSE(approximate_curve(points, std::vector<double>{0, 1, 0.5, 2, 3}).ok());
  EXPECT_FALSE(approximate_curve(points, std::vector<double>{0, 1, 2, nan, 3}).ok());
  EXPECT_FALSE(approximate_curve(points, std::vector<double>(5, 1.0)).ok());
  EXPECT_FALSE(approximate_curve(points, {.degree_u = 3, .max_control_points = 3}).ok());
  points[3].y() = nan;
  EXPECT_EQ(approximate_curve(points).error().field, "points[3]");
  EXPECT_EQ(interpolate_curve(points, 2).error().field, "points[3]");
  BSplineCurve dot{KnotVector::uniform(3, 4).value(), std::vector<Vec3>(4, Vec3(1, 2, 3)), {}};
  EXPECT_EQ(by_length(dot).error().field, "curve");
}

TEST(BSplineFit, BadGridsAreRefused) {
  GridData data = grid_of(6, 6, hood);
  EXPECT_FALSE(interpolate_grid({6, 5, data.points}, 3, 3).ok());
  EXPECT_FALSE(interpolate_grid({std::size_t{1} << 40, std::size_t{1} << 40, data.points}, 3, 3).ok());
  EXPECT_FALSE(interpolate_grid({6, 6, data.points}, 6, 3).ok());
  EXPECT_FALSE(interpolate_grid({0, 0, {}}, 3, 3).ok());
  std::vector<Vec3> twice = data.points;
  std::copy_n(twice.begin(), 6, twice.begin() + 6);
  EXPECT_EQ(interpolate_grid({6, 6, twice}, 3, 3).error().field, "points");
  EXPECT_FALSE(approximate_grid({6, 6, twice}).ok());
  data.points[8].x() = nan;
  EXPECT_EQ(approximate_grid({6, 6, data.points}).error().field, "points[8]");
}

TEST(BSplineFit, BadSamplesAndOptionsAreRefused) {
  std::vector<SurfaceSample> line, good;
  for (int i = 0; i < 20; ++i) {
    line.push_back({Vec3(i, i, 0), Vec2(i, i), 1});
    good.push_back({Vec3(i, i * i % 7, 0), Vec2(i, i * i % 7), 1});
  }
  EXPECT_TRUE(approximate_points(good).ok());
  EXPECT_FALSE(approximate_points({}).ok());
  EXPECT_EQ(approximate_points(line).error().field, "samples");
  auto bad = good;
  bad[3].uv.x() = nan;
  EXPECT_EQ(approximate_points(bad).error().field, "samples[3].uv");
  bad = good;
  bad[4].weight = -1;
  EXPECT_EQ(approximate_points(bad).error().field, "samples[4].weight");
  bad = good;
  bad[5].place.z() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(approximate_points(bad).error().field, "samples[5].place");
  for (SurfaceSample& s : bad = good) s.weight = 0;
  EXPECT_EQ(approximate_points(bad).error().field, "samples");
  EXPECT_EQ(approximate_points(good, {.degree_u = 0}).error().field, "options.degree_u");
  EXPECT_EQ(approximate_points(good, {.degree_v = 25}).error().field, "options.degree_v");
  EXPECT_EQ(approximate_points(good, {.tolerance_m = nan}).error().field, "options.tolerance_m");
  EXPECT_EQ(approximate_points(good, {.max_control_points = 0}).error().field, "options.max_control_points");
  EXPECT_EQ(approximate_points(good, {.max_control_points = 15}).error().field, "options.max_control_points");
  EXPECT_EQ(approximate_points(good, {.smoothing = 0}).error().field, "options.smoothing");
  EXPECT_EQ(approximate_points(good, {.first_spans_u = 0}).error().field, "options.first_spans_u");
  EXPECT_EQ(approximate_points(good, {.parameter_corrections = -1}).error().field,
            "options.parameter_corrections");
}

}  // namespace
}  // namespace handloft::geometry
