// Profile modification: A8 and A9 for surfaces that come from curves, A19 and A20.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "server-model/geometry/pca_frame.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/profile_modification.h"
#include "server-model/geometry/resample.h"
#include "server-model/geometry/residual_matching.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

constexpr double exact_tolerance = 1e-9;

/// max |c - c1| / max |c1| in scaled coefficients; the boxes agree since footprints don't move.
double coefficient_error(const PolynomialSurface& found, const PolynomialSurface& wanted) {
  if (found.degree() != wanted.degree()) return std::numeric_limits<double>::infinity();
  double difference = 0;
  double scale = 0;
  for (std::size_t k = 0; k < wanted.scaled_coefficients().size(); ++k) {
    difference =
        std::max(difference, std::abs(found.scaled_coefficients()[k] - wanted.scaled_coefficients()[k]));
    scale = std::max(scale, std::abs(wanted.scaled_coefficients()[k]));
  }
  return difference / scale;
}

Curve arch(double height, double y, double bend = 0.0, std::size_t n = 80) {
  Curve curve;
  for (std::size_t i = 0; i < n; ++i) {
    const double t = -1 + 2 * static_cast<double>(i) / static_cast<double>(n - 1);
    curve.push_back({0.03 + 0.09 * t, y + bend * t * t, height * (1 - t * t)});
  }
  return curve;
}

struct Edit {
  PolynomialSurface before;
  PolynomialSurface after;
  std::vector<WeightedPoint> moved;
};

Edit edit(const std::vector<WeightedPoint>& cloud, int degree, const std::vector<Curve>& strokes) {
  Edit result;
  result.before = fit_polynomial_surface(cloud, {.degree = degree})->surface;
  const auto fitter = ProfileFitter::create(cloud, result.before);
  EXPECT_TRUE(fitter.ok()) << (fitter.ok() ? "" : fitter.error().describe());
  const auto after = fitter->fit_with(*points_along(*prepare_strokes(strokes), cloud.size()));
  EXPECT_TRUE(after.ok());
  result.after = *after;
  result.moved = cloud;
  match_residuals(result.after, vertical_residuals(result.before, cloud), result.moved);
  return result;
}

double refit_error(const Edit& edit, int degree) {
  return coefficient_error(fit_polynomial_surface(edit.moved, {.degree = degree})->surface, edit.after);
}

TEST(ProfileModification, A8_RefitGivesTheSurfaceOfTheCurve) {
  std::mt19937_64 random(40);
  const std::vector<Curve> strokes = {arch(0.03, 0.0, 0.02), arch(0.02, -0.04)};
  for (int degree = 1; degree <= 4; ++degree) {
    for (const std::size_t n : {7UL, 16UL, 100UL, 1000UL, 10000UL, 100000UL}) {
      // Fewer points than coefficients carry a lower degree (A7): matched in the space that they carry.
      const Edit e = edit(test::random_cloud(random, n), degree, strokes);
      ASSERT_GT(coefficient_error(e.before, e.after), 0.01);  // Something was edited.
      EXPECT_LE(refit_error(e, degree), exact_tolerance) << "N = " << degree << ", n = " << n;
    }
  }
}

TEST(ProfileModification, A8_NegativeControls) {
  std::mt19937_64 random(41);
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 400);
  const Edit e = edit(cloud, 2, {arch(0.05, 0.0)});
  ASSERT_LE(refit_error(e, 2), exact_tolerance);

  Edit orthogonal = e;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3& p = cloud[i].position;
    const double r = (p.z() - e.before.value(p.x(), p.y())) * e.before.normal(p.x(), p.y()).z();
    orthogonal.moved[i].position = e.after.point(p.x(), p.y()) + r * e.after.normal(p.x(), p.y());
  }
  EXPECT_GT(refit_error(orthogonal, 2), 1e3 * exact_tolerance);

  Edit reweighted = e;
  for (WeightedPoint& p : reweighted.moved) p.weight = test::uniform(random, 0.05, 1);
  EXPECT_GT(refit_error(reweighted, 2), 1e3 * exact_tolerance);

  PcaOptions options;
  options.previous = Frame{};
  const Frame plane = pca_frame(e.moved, options)->frame;
  const auto replaned = fit_polynomial_surface(e.moved, plane, {.degree = 2});
  double apart = 0;
  for (const WeightedPoint& p : e.moved) {
    const Vec3 on_f1 = plane.to_local(e.after.point(p.position.x(), p.position.y()));
    apart = std::max(apart, std::abs(replaned->surface.value(on_f1.x(), on_f1.y()) - on_f1.z()));
  }
  EXPECT_GT(apart, 1e3 * exact_tolerance * 0.05);  // Of heights of 5 cm.

  Edit stale = e;
  std::vector<WeightedPoint> pushed = cloud;
  for (std::size_t i = 0; i < 40; ++i) pushed[i].position.z() += 0.02;
  stale.moved = pushed;
  match_residuals(e.after, vertical_residuals(e.before, pushed), stale.moved);
  EXPECT_GT(refit_error(stale, 2), 1e3 * exact_tolerance);
}

TEST(ProfileModification, A9_AStaleFitIsNoticed_RefitFirstIsExact) {
  std::mt19937_64 random(42);
  std::vector<WeightedPoint> cloud = test::random_cloud(random, 400);
  const PolynomialSurface old = fit_polynomial_surface(cloud)->surface;
  for (std::size_t i = 0; i < 5; ++i) cloud[i].position.z() += 0.001;
  const auto stale = ProfileFitter::create(cloud, old);
  ASSERT_FALSE(stale.ok());
  EXPECT_EQ(stale.error().code, ErrorCode::failed_precondition);
  EXPECT_LE(refit_error(edit(cloud, 2, {arch(0.05, 0.0)}), 2), exact_tolerance);
}

TEST(ProfileModification, A19_IsTheFitOfOriginalsAndTemporariesTogether) {
  std::mt19937_64 random(43);
  for (const int degree : {1, 2, 3, 5}) {
    const std::vector<WeightedPoint> cloud = test::random_cloud(random, 300);
    const std::vector<Curve> strokes = {arch(0.03, 0.01), arch(0.02, -0.05, 0.03)};
    const Edit e = edit(cloud, degree, strokes);
    std::vector<WeightedPoint> all = cloud;
    const auto temporary = points_along(*prepare_strokes(strokes), cloud.size());
    ASSERT_EQ(temporary->size(), cloud.size());  // As many as the originals, in total.
    for (const Vec3& p : *temporary) all.push_back({p, 1.0});
    const auto together = fit_polynomial_surface(all, {.degree = degree});
    for (const WeightedPoint& p : all) {
      const double x = p.position.x();
      const double y = p.position.y();
      EXPECT_NEAR(together->surface.value(x, y), e.after.value(x, y), 1e-11) << degree;
    }
    EXPECT_EQ(e.moved.size(), cloud.size());  // The temporaries are gone.
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      EXPECT_EQ(e.moved[i].position.head<2>(), cloud[i].position.head<2>());
      EXPECT_EQ(e.moved[i].weight, cloud[i].weight);
    }
  }
}

TEST(ProfileModification, A19_OrderAndDirectionOfStrokesChangeNothing) {
  std::mt19937_64 random(44);
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 101);
  // Two of one length, and an odd number of points to share: a tie.
  std::vector<Curve> strokes = {arch(0.03, 0.01), arch(0.03, -0.03), arch(0.01, 0.02, 0.01, 30)};
  for (Curve& stroke : strokes) {
    for (Vec3& p : stroke) p.z() += test::uniform(random, -1e-3, 1e-3);
  }
  const PolynomialSurface wanted = edit(cloud, 3, strokes).after;
  std::vector<std::size_t> order = {0, 1, 2};
  do {
    for (unsigned reversed = 0; reversed < 8; ++reversed) {
      std::vector<Curve> other;
      for (const std::size_t k : order) {
        other.push_back(strokes[k]);
        if ((reversed >> k & 1U) != 0) std::reverse(other.back().begin(), other.back().end());
      }
      EXPECT_LE(coefficient_error(edit(cloud, 3, other).after, wanted), 1e-12);
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(ProfileModification, A19_ACurveOnTheSurfaceChangesNothing) {
  std::mt19937_64 random(45);
  for (int degree = 1; degree <= 4; ++degree) {
    const std::vector<WeightedPoint> cloud = test::random_cloud(random, 200);
    const PolynomialSurface surface = fit_polynomial_surface(cloud, {.degree = degree})->surface;
    std::vector<Vec3> on_it = arch(0, 0.01, 0.02, 200);
    for (Vec3& p : on_it) p.z() = surface.value(p.x(), p.y());
    const auto after = ProfileFitter::create(cloud, surface)->fit_with(on_it);
    EXPECT_LE(coefficient_error(*after, surface), 1e-12);
    EXPECT_EQ(*ProfileFitter::create(cloud, surface)->fit_with({}), surface);
  }
}

TEST(ProfileModification, A19_OversketchingPullsTheSurfaceToTheCurve) {
  std::mt19937_64 random(46);
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 200, 0.08, 0.05, 0.001);
  const Curve stroke = arch(0.04, -0.02);
  const auto distance = [&](const PolynomialSurface& surface) {
    double sum = 0;
    for (const Vec3& p : stroke) sum += std::abs(surface.value(p.x(), p.y()) - p.z());
    return sum / static_cast<double>(stroke.size());
  };
  const Edit once = edit(cloud, 2, {stroke});
  EXPECT_LT(distance(once.after), 0.5 * distance(once.before));
  // The same curve again brings it nearer, and twice at once as near as once: the number of points is the
  // same.
  const Edit again = edit(once.moved, 2, {stroke});
  EXPECT_LT(distance(again.after), 0.5 * distance(once.after));
  EXPECT_LE(coefficient_error(edit(cloud, 2, {stroke, stroke}).after, once.after), 0.02);
}

TEST(ProfileModification, A19_PointsAreSharedByLength) {
  const auto line = [](double length) { return Curve{{0, 0, 0}, {length, 0, 0}}; };
  using Shares = std::vector<std::size_t>;
  EXPECT_EQ(share_by_length(std::vector<Curve>{line(1), line(3)}, 100),
            (Shares{26, 74}));  // 1 + 98 / 4, 1 + 3 * 98 / 4
  EXPECT_EQ(share_by_length(std::vector<Curve>{line(1), line(1)}, 7), (Shares{4, 3}));
  EXPECT_EQ(share_by_length(std::vector<Curve>{line(0), line(1)}, 10), (Shares{1, 9}));
  EXPECT_EQ(share_by_length(std::vector<Curve>{line(0), line(0)}, 10), (Shares{5, 5}));
  EXPECT_EQ(share_by_length(std::vector<Curve>{line(1), line(5), line(2)}, 2), (Shares{0, 1, 1}));
  EXPECT_EQ(share_by_length(std::vector<Curve>{line(1)}, 0), (Shares{0}));
  EXPECT_TRUE(share_by_length({}, 10).empty());
  std::mt19937_64 random(47);
  for (int round = 0; round < 200; ++round) {
    std::vector<Curve> curves;
    for (int k = 0; k < 1 + round % 9; ++k) curves.push_back(line(test::uniform(random, 0, 1)));
    const std::size_t total = static_cast<std::size_t>(round) * 7;
    const Shares shares = share_by_length(curves, total);
    EXPECT_EQ(std::accumulate(shares.begin(), shares.end(), std::size_t{0}), total);
  }
}

TEST(ProfileModification, CurvesFarOutsideOfTheFootprint) {
  std::mt19937_64 random(48);
  const std::vector<WeightedPoint> cloud = test::random_cloud(random, 200);
  for (int degree = 1; degree <= 6; ++degree) {
    const PolynomialSurface surface = fit_polynomial_surface(cloud, {.degree = degree})->surface;
    const auto fitter = ProfileFitter::create(cloud, surface);
    const PolynomialSurface wanted = test::random_surface(random, degree, surface.box());
    std::vector<Vec3> far;
    for (int i = 0; i < 200; ++i) {
      const double x = test::uniform(random, 0.5, 1.0);
      const double y = test::uniform(random, -0.5, 0.5);
      far.push_back({x, y, wanted.value(x, y)});
    }
    const auto after = fitter->fit_with(far);
    ASSERT_TRUE(after.ok()) << degree;
    for (const double c : after->scaled_coefficients()) EXPECT_TRUE(std::isfinite(c));
    EXPECT_FALSE(fitter->fit_with(std::vector<Vec3>{{1e300, 0, 0}}).ok());
    const auto beyond = fitter->fit_with(std::vector<Vec3>{{1e90, 1e90, 1e90}});
    if (beyond.ok()) {
      for (const double c : beyond->scaled_coefficients()) EXPECT_TRUE(std::isfinite(c));
    }
  }
}

TEST(ProfileModification, BadInputIsRefused) {
  std::mt19937_64 random(49);
  std::vector<WeightedPoint> cloud = test::random_cloud(random, 50);
  const PolynomialSurface surface = fit_polynomial_surface(cloud)->surface;
  const auto fitter = ProfileFitter::create(cloud, surface);
  EXPECT_EQ(fitter->fit_with(std::vector<Vec3>{{0, 0, 0}, {0, std::nan(""), 0}}).error().field,
            "curve_points[1].position");
  EXPECT_EQ(ProfileFitter::create(cloud, surface, {.curve_weight = 0}).error().field, "curve_weight");
  EXPECT_EQ(ProfileFitter::create({}, surface).error().code, ErrorCode::rank_deficient);
  EXPECT_EQ(ProfileFitter::create(std::span(cloud).first(5), surface).error().code,
            ErrorCode::rank_deficient);
  cloud[3].weight = -1;
  EXPECT_EQ(ProfileFitter::create(cloud, surface).error().field, "points[3].weight");
  EXPECT_EQ(prepare_strokes(std::vector<Curve>{{}, {{0, 0, std::nan("")}}}).error().field,
            "strokes[1].points[0]");
  EXPECT_TRUE(prepare_strokes(std::vector<Curve>{{}, {}})->empty());
}

TEST(ProfileModification, A18_CurvesOfAFewCornersAreNotFlattened) {
  const Curve corners = {{-0.03, 0, 0.03}, {0, 0, 0.045}, {0.03, 0, 0.03}};
  EXPECT_EQ(*prepare_strokes(std::vector<Curve>{corners}), std::vector<Curve>{corners});
  const Curve dense = arch(0.03, 0.0, 0.0, 9);
  EXPECT_NE(*prepare_strokes(std::vector<Curve>{dense}), std::vector<Curve>{dense});
}

TEST(KeptCurve, A20_ATenthOfThePoints) {
  EXPECT_EQ(kept_point_count(100), 10U);
  EXPECT_EQ(kept_point_count(0), 1U);
  EXPECT_EQ(kept_point_count(4), 1U);
  EXPECT_EQ(kept_point_count(14), 1U);
  EXPECT_EQ(kept_point_count(15), 2U);
  EXPECT_EQ(kept_point_count(100000), 10000U);
}

TEST(KeptCurve, A20_HundredPointsBecomeHundredAndTen_RefitEqualsF1) {
  std::mt19937_64 random(50);
  for (int degree = 1; degree <= 4; ++degree) {
    const std::vector<Curve> strokes = {arch(0.03, 0.0, 0.02), arch(0.02, -0.04)};
    const std::vector<WeightedPoint> cloud = test::random_cloud(random, 100);
    Edit e = edit(cloud, degree, strokes);
    const auto kept = curves_on_surface(e.after, *prepare_strokes(strokes), kept_point_count(cloud.size()));
    ASSERT_TRUE(kept.ok());
    for (const Curve& curve : *kept) {
      for (const Vec3& p : curve) {
        EXPECT_NEAR(p.z(), e.after.value(p.x(), p.y()), 1e-15);
        e.moved.push_back({p, mean_weight(cloud)});
      }
    }
    EXPECT_EQ(e.moved.size(), 110U);
    const auto refit = fit_polynomial_surface(e.moved, {.degree = degree});
    double scale = 0;
    for (const double c : e.after.scaled_coefficients()) scale = std::max(scale, std::abs(c));
    for (const WeightedPoint& p : e.moved) {
      const double x = p.position.x();
      const double y = p.position.y();
      EXPECT_NEAR(refit->surface.value(x, y), e.after.value(x, y), exact_tolerance * scale);
    }
  }
}

TEST(KeptCurve, A20_EvenlySpacedOnTheSurface) {
  // Steep on one side: even spacing before the projection would be uneven after it.
  const auto surface = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 10., 0.});
  const Curve straight = {{0, 0, 0.3}, {0.15, 0.02, 0.3}};
  const auto kept = curves_on_surface(*surface, std::vector<Curve>{straight}, 200);
  ASSERT_TRUE(kept.ok());
  double least = 1;
  double most = 0;
  for (std::size_t i = 1; i < 200; ++i) {
    const double d = ((*kept)[0][i] - (*kept)[0][i - 1]).norm();
    least = std::min(least, d);
    most = std::max(most, d);
  }
  EXPECT_LT((most - least) / most, 1e-3);
}

TEST(KeptCurve, A20_TheWeightIsTheMean) {
  std::mt19937_64 random(51);
  std::vector<WeightedPoint> points;
  for (int i = 0; i < 1000; ++i) points.push_back({Vec3::Zero(), i % 2 == 0 ? 0.25 : 0.75});
  EXPECT_NEAR(mean_weight(points), 0.5, 1e-15);
  for (WeightedPoint& p : points) p.weight = 0.1;
  EXPECT_NEAR(mean_weight(points), 0.1, 1e-15);
  EXPECT_EQ(mean_weight({}), 0);
}

}  // namespace
}  // namespace handloft::geometry
