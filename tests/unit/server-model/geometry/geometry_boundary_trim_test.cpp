#include "server-model/geometry/boundary_trim.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "server-model/geometry/trim_field.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

constexpr double pi = std::numbers::pi;

std::vector<Vec2> circle(std::size_t count, double radius = 1, double turn = 2 * pi) {
  std::vector<Vec2> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = turn * static_cast<double>(i) / static_cast<double>(count);
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return points;
}

/// Two unit squares' worth of loops, joined at the origin, gone round in opposite senses.
std::vector<Vec2> figure_eight(std::size_t count) {
  std::vector<Vec2> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = 2 * pi * static_cast<double>(i) / static_cast<double>(count);
    points.emplace_back(std::sin(t), std::sin(t) * std::cos(t));
  }
  return points;
}

/// The same by trying every segment.
double slow_distance(const std::vector<Vec2>& polygon, const Vec2& p) {
  double best = 1e300;
  bool odd = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2& a = polygon[i];
    const Vec2& b = polygon[(i + 1) % polygon.size()];
    const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    best = std::min(best, (a + t * (b - a) - p).norm());
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) {
      odd = !odd;
    }
  }
  return odd ? best : -best;
}

TEST(BoundaryTrim, A24_UnitCircle) {
  const auto trim = BoundaryTrim::create(circle(2000));
  ASSERT_TRUE(trim.ok());
  EXPECT_NEAR(trim->reach(), 1, 1.1e-4);
  EXPECT_NEAR(trim->opacity({0, 0}), 0.99995, 1e-5);
  for (double angle = 0; angle < 6; angle += 0.7) {
    const Vec2 out(std::cos(angle), std::sin(angle));
    EXPECT_NEAR(trim->opacity(out), 0.5, 1e-3);
    EXPECT_NEAR(trim->opacity(1.5 * out), 1 / (1 + std::exp(5)), 1e-5);
    EXPECT_NEAR(trim->opacity(1.5 * out), 0.0067, 5e-5);
  }
}

TEST(BoundaryTrim, A24_OpacityFollowsEquation8) {
  EXPECT_EQ(boundary_opacity(0, 0.3), 0.5);
  EXPECT_NEAR(boundary_opacity(0.3, 0.3), 0.9999546, 1e-7);
  EXPECT_EQ(boundary_opacity(std::nan(""), 1), 0);
  EXPECT_EQ(boundary_opacity(-1e300, 1e-5), 0);
  EXPECT_EQ(boundary_opacity(1e300, 1e-5), 1);
  EXPECT_NEAR(boundary_distance_of_opacity(faintest_opacity), -0.5537, 1e-4);
  for (const double t : {0.01, 0.5, 0.9}) {
    EXPECT_NEAR(boundary_opacity(2 * boundary_distance_of_opacity(t), 2), t, 1e-14);
  }
}

TEST(BoundaryTrim, A24_ReachBelongsToTheCurveAndNoMesh) {
  // A rectangle with a bay: the largest circle inside is found to the tolerance, and with it T at any place,
  // whatever is meshed. The paper's d_max over the vertices of two meshes differs.
  const std::vector<Vec2> bay{{-3, -1}, {3, -1}, {3, 1}, {0.5, 1}, {0, 0.2}, {-0.5, 1}, {-3, 1}, {-3, -1}};
  const auto trim = BoundaryTrim::create(bay);
  ASSERT_TRUE(trim.ok());
  double deepest = 0;  // On a fine grid.
  for (double x = -3; x <= 3; x += 0.005) {
    for (double y = -1; y <= 1; y += 0.005) deepest = std::max(deepest, slow_distance(bay, {x, y}));
  }
  EXPECT_NEAR(trim->reach(), deepest, 1e-2 * deepest);
  EXPECT_GE(trim->reach(), deepest * (1 - 1e-4));
  EXPECT_NEAR(trim->signed_distance(trim->deepest()), trim->reach(), 1e-15);

  const auto paper_reach = [&](double extent, int side) {
    double reach = 0;
    for (int i = 0; i <= side; ++i) {
      for (int j = 0; j <= side; ++j) {
        const Vec2 p = extent * Vec2(2.0 * i / side - 1, 2.0 * j / side - 1);
        reach = std::max(reach, trim->signed_distance(p));
      }
    }
    return reach;
  };
  const Vec2 fixed(2.2, 0.8);
  const double before = boundary_opacity(trim->signed_distance(fixed), paper_reach(3.1, 21));
  const double doubled = boundary_opacity(trim->signed_distance(fixed), paper_reach(6.2, 21));
  EXPECT_GT(std::abs(before - doubled), 1e-6) << "negative control: the printed d_max depends on the mesh";
}

TEST(BoundaryTrim, A24_FigureEightByEvenOdd) {
  const auto trim = BoundaryTrim::create(figure_eight(400));
  ASSERT_TRUE(trim.ok());
  EXPECT_TRUE(trim->inside({0.6, 0}));
  EXPECT_TRUE(trim->inside({-0.6, 0}));
  EXPECT_FALSE(trim->inside({0, 0.3}));
  EXPECT_GT(trim->opacity({-0.65, 0}), 0.99);
  EXPECT_NEAR(trim->opacity({0.65, 0}), trim->opacity({-0.65, 0}), 1e-9);
  EXPECT_LT(trim->opacity({0, 0.5}), 0.01);

  // A curl: what is gone round twice is outside.
  std::vector<Vec2> twice = circle(200);
  for (const Vec2& p : circle(200, 0.4)) twice.push_back(p);
  const auto ring = BoundaryTrim::create(twice, {.max_gap_fraction = 0.2});
  ASSERT_TRUE(ring.ok());
  EXPECT_FALSE(ring->inside({0, 0}));
  EXPECT_TRUE(ring->inside({0, 0.7}));
}

TEST(BoundaryTrim, A24_ClosesSmallGapsAndRefusesLargeOnes) {
  const double open = 2 * pi * 0.95;
  EXPECT_TRUE(BoundaryTrim::create(circle(400, 1, open)).ok());
  const auto wide = BoundaryTrim::create(circle(400, 1, 1.7 * pi));
  ASSERT_FALSE(wide.ok());
  EXPECT_EQ(wide.error().code, ErrorCode::invalid_argument);
  // Chord of the remaining 0.3 pi (and a step), and an arc of 1.7 pi: both figures are named.
  EXPECT_NE(wide.error().message.find("gap of 0.91"), std::string::npos) << wide.error().message;
  EXPECT_NE(wide.error().message.find("curve of 5.3"), std::string::npos) << wide.error().message;
  EXPECT_NE(wide.error().message.find("at most 0.53"), std::string::npos) << wide.error().message;
  // Both sides of the tenth, on a square less a part of its last side.
  const auto square = [](double gap) { return std::vector<Vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, gap}}; };
  EXPECT_TRUE(BoundaryTrim::create(square(4 / 11.0 - 1e-9)).ok());
  EXPECT_FALSE(BoundaryTrim::create(square(4 / 11.0 + 1e-9)).ok());
}

TEST(BoundaryTrim, A24_GapIsMeasuredInSpace) {
  // A helix whose ends meet as seen from above and are far apart.
  std::vector<Vec3> helix;
  for (int i = 0; i <= 100; ++i) {
    const double angle = 2 * pi * i / 100;
    helix.emplace_back(std::cos(angle), std::sin(angle), 0.02 * i);
  }
  EXPECT_FALSE(BoundaryTrim::create(helix, Frame{}).ok());
  for (Vec3& p : helix) p.z() *= 0.1;
  const auto flat = BoundaryTrim::create(helix, Frame{});
  ASSERT_TRUE(flat.ok());
  EXPECT_NEAR(flat->reach(), 1, 1e-3);
}

TEST(BoundaryTrim, A24_ProjectsAlongTheFrame) {
  std::mt19937_64 random(5);
  const Frame frame = test::random_frame(random);
  std::vector<Vec3> world;
  for (const Vec2& p : circle(100, 0.05))
    world.push_back(frame.to_world({p.x(), p.y(), test::uniform(random, -0.01, 0.01)}));
  const auto trim = BoundaryTrim::create(world, frame, {.max_gap_fraction = 0.5});
  ASSERT_TRUE(trim.ok());
  const auto flat = BoundaryTrim::create(circle(100, 0.05));
  for (int i = 0; i < 50; ++i) {
    const Vec2 p(test::uniform(random, -0.1, 0.1), test::uniform(random, -0.1, 0.1));
    EXPECT_NEAR(trim->opacity(p), flat->opacity(p), 1e-9);
  }
}

TEST(BoundaryTrim, TreeAgreesWithTryingEverySegment) {
  std::mt19937_64 random(6);
  for (const std::size_t count : {3U, 7U, 8U, 9U, 64U, 777U}) {
    std::vector<Vec2> points;
    for (std::size_t i = 0; i < count; ++i) {
      const double angle = 2 * pi * static_cast<double>(i) / static_cast<double>(count);
      points.push_back(test::uniform(random, 0.3, 1.0) * Vec2(std::cos(angle), 3 * std::sin(2 * angle)));
    }
    const auto trim = BoundaryTrim::create(points, {.max_gap_fraction = 10});
    ASSERT_TRUE(trim.ok()) << count;
    for (int k = 0; k < 200; ++k) {
      const Vec2 p(test::uniform(random, -2, 2), test::uniform(random, -4, 4));
      EXPECT_NEAR(trim->signed_distance(p), slow_distance(trim->polygon(), p), 1e-12);
    }
    // Vertices' own heights: a ray through vertices counts each once.
    for (const Vec2& vertex : points) {
      const Vec2 p(test::uniform(random, -2, 2), vertex.y());
      EXPECT_NEAR(trim->signed_distance(p), slow_distance(trim->polygon(), p), 1e-12);
    }
  }
}

TEST(BoundaryTrim, A24_SampleDistanceIsThereForParity) {
  const std::vector<Vec2> square{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  const auto segments = BoundaryTrim::create(square, {.max_gap_fraction = 1});
  const auto samples = BoundaryTrim::create(
      square, {.distance = BoundaryTrimOptions::Distance::samples, .max_gap_fraction = 1});
  ASSERT_TRUE(segments.ok());
  ASSERT_TRUE(samples.ok());
  EXPECT_NEAR(segments->signed_distance({0.9, 0}), 0.1, 1e-15);
  EXPECT_NEAR(samples->signed_distance({0.9, 0}), std::hypot(0.1, 1.0), 1e-15);
  EXPECT_NEAR(segments->reach(), 1, 1e-4);
  EXPECT_NEAR(samples->reach(), std::numbers::sqrt2, 1e-3);
}

TEST(BoundaryTrim, BadCurvesAreRefused) {
  const auto code = [](const std::vector<Vec2>& curve, BoundaryTrimOptions options = {}) {
    const auto trim = BoundaryTrim::create(curve, options);
    return trim.ok() ? ErrorCode::internal : trim.error().code;
  };
  EXPECT_EQ(code({}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{0, 0}, {1, 0}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{0, 0}, {0, 0}, {0, 0}, {0, 0}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{0, 0}, {1, 0}, {2, 0}, {1, 0}, {0, 0}}), ErrorCode::invalid_argument) << "no area";
  EXPECT_EQ(code({{0, 0}, {1, 1}, {2, 2}, {1, 1}, {0, 0}}), ErrorCode::invalid_argument) << "no area";
  EXPECT_EQ(code({{0, 0}, {1, std::nan("")}, {0, 1}, {0, 0}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code({{0, 0}, {1e308, 0}, {1e308, 1e308}, {-1e308, 0}}), ErrorCode::invalid_argument);
  EXPECT_EQ(code(circle(101), {.max_vertices = 100}), ErrorCode::resource_exhausted);
  EXPECT_FALSE(BoundaryTrim::create(circle(50))->inside({std::nan(""), 0}));
  EXPECT_EQ(BoundaryTrim::create(circle(50))->opacity({std::nan(""), 0}), 0);
  // A long strip of even width, where every place of the ridge is as deep: the search ends.
  const auto strip = BoundaryTrim::create(std::vector<Vec2>{{0, 0}, {100, 0.001}, {100, 1}, {0, 1}, {0, 0}},
                                          BoundaryTrimOptions{});
  ASSERT_TRUE(strip.ok());
  EXPECT_NEAR(strip->reach(), 0.4995, 1e-3);
}

TEST(TrimField, A22_A24_BothKindsAnswerAlike) {
  const auto superellipse = Superellipse::create({{0.01, 0.02}, {0.05, 0.03}}, 3);
  const TrimField oval(*superellipse);
  const auto boundary = std::make_shared<const BoundaryTrim>(*BoundaryTrim::create(circle(300, 0.04)));
  const TrimField drawn(boundary);
  EXPECT_NE(oval.superellipse(), nullptr);
  EXPECT_EQ(oval.boundary(), nullptr);
  EXPECT_EQ(drawn.superellipse(), nullptr);
  EXPECT_EQ(drawn.boundary(), boundary.get());
  for (const TrimField* trim : {&oval, &drawn}) {
    EXPECT_TRUE(trim->solid(trim->core()));
    for (const Vec2& p : trim->outline()) EXPECT_NEAR(trim->opacity(p), solid_opacity, 1e-9);
    const Box2 visible = trim->visible_box();
    for (double t = -1; t <= 1; t += 0.01) {  // Along the box's border.
      for (const Vec2& unit : {Vec2(t, 1), Vec2(t, -1), Vec2(1, t), Vec2(-1, t)}) {
        EXPECT_LE(trim->opacity(visible.centre + unit.cwiseProduct(visible.half_extent)),
                  faintest_opacity + 1e-12);
      }
    }
    const Box2 solid = trim->solid_box();
    EXPECT_LT(solid.half_extent.x(), visible.half_extent.x());
  }
}

}  // namespace
}  // namespace handloft::geometry
