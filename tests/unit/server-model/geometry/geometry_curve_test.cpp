// A18: Savitzky-Golay smoothing and even resampling of freehand curves.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "server-model/geometry/curve_smoothing.h"
#include "server-model/geometry/resample.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

std::vector<Vec3> quadratic_curve(std::size_t n) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i);
    points.push_back({0.01 * t, 0.002 * t * t - 0.03 * t, 0.1 - 0.001 * t * t});
  }
  return points;
}

double largest_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

TEST(CurveSmoothing, A18_ClassicCoefficients) {
  const auto five = smoothing_weights(5, 2);
  ASSERT_TRUE(five.ok());
  const std::array<double, 5> classic5 = {-3, 12, 17, 12, -3};
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR((*five)[k], classic5[k] / 35, 1e-15);

  // The tables of 1964 for 7 and 9 points, and for 7 points and a quartic.
  const auto seven = smoothing_weights(7, 3);
  const std::array<double, 7> classic7 = {-2, 3, 6, 7, 6, 3, -2};
  for (std::size_t k = 0; k < 7; ++k) EXPECT_NEAR((*seven)[k], classic7[k] / 21, 1e-15);
  const auto nine = smoothing_weights(9, 2);
  const std::array<double, 9> classic9 = {-21, 14, 39, 54, 59, 54, 39, 14, -21};
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR((*nine)[k], classic9[k] / 231, 1e-15);
  const auto quartic = smoothing_weights(7, 4);
  const std::array<double, 7> classic_quartic = {5, -30, 75, 131, 75, -30, 5};
  for (std::size_t k = 0; k < 7; ++k) EXPECT_NEAR((*quartic)[k], classic_quartic[k] / 231, 1e-14);
}

TEST(CurveSmoothing, A18_AnyWindowAndOrderReproducesItsPolynomials) {
  for (const auto& [window, order] :
       {std::pair{1, 0}, {3, 0}, {3, 2}, {9, 2}, {21, 6}, {51, 10}, {255, 2}, {255, 60}}) {
    const auto weights = smoothing_weights(window, order);
    ASSERT_TRUE(weights.ok());
    const int half = window / 2;
    for (int power = 0; power <= order; ++power) {
      double sum = 0;
      for (int k = -half; k <= half; ++k) {
        const double t = half == 0 ? 0 : static_cast<double>(k) / half;
        sum += (*weights)[static_cast<std::size_t>(k + half)] * std::pow(t, power);
      }
      EXPECT_NEAR(sum, power == 0 ? 1 : 0, 1e-13) << window << ", " << order << ", t^" << power;
    }
  }
  // An order one below the window leaves every sample as it is.
  const auto identity = smoothing_weights(9, 8);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR((*identity)[k], k == 4 ? 1 : 0, 1e-13);
}

TEST(CurveSmoothing, A18_ReproducesAnyQuadraticInTheInterior) {
  const std::vector<Vec3> curve = quadratic_curve(40);
  for (const CurveEnds ends : {CurveEnds::mirrored_through_end, CurveEnds::mirrored_at_end}) {
    const auto smooth = smooth_curve(curve, {.ends = ends});
    ASSERT_TRUE(smooth.ok());
    ASSERT_EQ(smooth->size(), curve.size());
    for (std::size_t i = 4; i + 4 < curve.size(); ++i) {
      EXPECT_LE(((*smooth)[i] - curve[i]).norm(), 1e-12);
    }
  }
}

TEST(CurveSmoothing, A18_EndsStayAndStraightLinesStayStraight) {
  const std::vector<Vec3> curve = quadratic_curve(40);
  const auto smooth = smooth_curve(curve);
  EXPECT_LE((smooth->front() - curve.front()).norm(), 1e-15);
  EXPECT_LE((smooth->back() - curve.back()).norm(), 1e-15);
  // The literal mirror image draws the ends in.
  const auto literal = smooth_curve(curve, {.ends = CurveEnds::mirrored_at_end});
  EXPECT_GT((literal->front() - curve.front()).norm(), 1e-3);

  std::vector<Vec3> line;
  for (int i = 0; i < 12; ++i) line.push_back(Vec3(0.1, -0.2, 0.3) * i);
  EXPECT_LE(largest_distance(*smooth_curve(line), line), 1e-14);
}

TEST(CurveSmoothing, TakesTheTremorOut) {
  std::mt19937_64 random(1);
  std::vector<Vec3> curve = quadratic_curve(200);
  for (Vec3& p : curve) p *= 0.1;
  std::vector<Vec3> shaky = curve;
  for (Vec3& p : shaky) {
    for (int k = 0; k < 3; ++k) p[k] += test::uniform(random, -1e-3, 1e-3);
  }
  const auto rms = [&](const std::vector<Vec3>& a) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - curve[i]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(a.size()));
  };
  // The noise falls by the norm of the weights, sqrt(59 / 231) = 0.505.
  EXPECT_NEAR(rms(*smooth_curve(shaky)) / rms(shaky), std::sqrt(59.0 / 231.0), 0.05);
}

TEST(CurveSmoothing, ShortCurvesAndBadInput) {
  for (std::size_t n = 0; n < 9; ++n) {
    const auto smooth = smooth_curve(quadratic_curve(n));
    ASSERT_TRUE(smooth.ok());
    ASSERT_EQ(smooth->size(), n);
    for (const Vec3& p : *smooth) EXPECT_TRUE(p.allFinite());
  }
  const auto wide = smooth_curve(quadratic_curve(3), {.window = 255});
  EXPECT_TRUE(wide->at(1).allFinite());
  EXPECT_EQ(smooth_curve({}, {.window = 8}).error().field, "window");
  EXPECT_EQ(smooth_curve({}, {.window = 257}).error().field, "window");
  EXPECT_EQ(smooth_curve({}, {.window = -1}).error().field, "window");
  EXPECT_EQ(smooth_curve({}, {.window = 9, .order = 9}).error().field, "order");
  EXPECT_EQ(smooth_curve({}, {.window = 9, .order = -1}).error().field, "order");
  std::vector<Vec3> bad = quadratic_curve(5);
  bad[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(smooth_curve(bad).error().field, "points[3]");
}

TEST(Resample, A18_SpacingIsEven) {
  // A wave drawn at a very uneven pace.
  std::vector<Vec3> curve;
  for (int i = 0; i <= 400; ++i) {
    const double t = std::pow(i / 400.0, 2.0);
    curve.push_back({0.2 * t, 0.02 * std::sin(6 * t), 0.01 * std::cos(4 * t)});
  }
  for (const std::size_t count : {50U, 100U, 1000U}) {
    const auto even = resample_evenly(curve, count);
    ASSERT_TRUE(even.ok());
    ASSERT_EQ(even->size(), count);
    EXPECT_EQ(even->front(), curve.front());
    EXPECT_EQ(even->back(), curve.back());
    double least = 1;
    double most = 0;
    for (std::size_t i = 1; i < count; ++i) {
      const double d = ((*even)[i] - (*even)[i - 1]).norm();
      least = std::min(least, d);
      most = std::max(most, d);
    }
    EXPECT_LT((most - least) / most, 1e-3) << count;
  }
}

TEST(Resample, HandValuesAndDegenerateCurves) {
  const std::vector<Vec3> bent = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}};
  const auto five = resample_evenly(bent, 5);
  const std::vector<Vec3> expected = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {3, 1, 0}};
  EXPECT_LE(largest_distance(*five, expected), 1e-15);
  EXPECT_LE((resample_evenly(bent, 1)->at(0) - Vec3(2, 0, 0)).norm(), 1e-15);
  EXPECT_TRUE(resample_evenly(bent, 0)->empty());
  EXPECT_DOUBLE_EQ(curve_length(bent), 4);

  const std::vector<Vec3> dot(3, Vec3(1, 2, 3));
  const auto dots = resample_evenly(dot, 4);
  ASSERT_TRUE(dots.ok());
  for (const Vec3& p : *dots) EXPECT_EQ(p, Vec3(1, 2, 3));

  EXPECT_EQ(resample_evenly({}, 4).error().field, "points");
  const double huge = std::numeric_limits<double>::max();
  EXPECT_EQ(resample_evenly(std::vector<Vec3>{{-huge, 0, 0}, {huge, 0, 0}}, 3).error().field, "points");
  EXPECT_EQ(resample_evenly(std::vector<Vec3>{{0, 0, 0}, {0, 0, std::nan("")}}, 3).error().field,
            "points[1]");
}

TEST(Resample, SplitsAtFractionsOfTheLength) {
  const std::vector<Vec3> bent = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}};
  const auto parts = split_curve(bent, std::array{0.25, 0.75});
  ASSERT_TRUE(parts.ok());
  ASSERT_EQ(parts->size(), 3U);
  EXPECT_EQ((*parts)[0], (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}}));
  EXPECT_EQ((*parts)[1], (std::vector<Vec3>{{1, 0, 0}, {3, 0, 0}}));  // A cut at a point doesn't double it.
  EXPECT_EQ((*parts)[2], (std::vector<Vec3>{{3, 0, 0}, {3, 1, 0}}));

  const auto edges = split_curve(bent, std::array{0.0, 0.5, 0.5, 1.0});
  ASSERT_EQ(edges->size(), 5U);
  double length = 0;
  for (const auto& part : *edges) {
    EXPECT_FALSE(part.empty());
    length += curve_length(part);
  }
  EXPECT_NEAR(length, 4, 1e-15);
  EXPECT_EQ(*split_curve(bent, {}), (std::vector<std::vector<Vec3>>{bent}));

  EXPECT_EQ(split_curve(bent, std::array{0.5, 0.4}).error().field, "fractions[1]");
  EXPECT_EQ(split_curve(bent, std::array{1.5}).error().field, "fractions[0]");
  EXPECT_EQ(split_curve(bent, std::array{std::nan("")}).error().field, "fractions[0]");
}

}  // namespace
}  // namespace handloft::geometry
