#include "server-model/geometry/tessellate.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "server-model/geometry/trimesh.h"
#include "test_surfaces.h"

namespace handloft::geometry {
namespace {

PolynomialSurface dome() {
  return *PolynomialSurface::from_coefficients(2, std::array{0.02, 0., 0., 0.5, -2., -4.});
}
Superellipse ellipse(double n) {
  return *Superellipse::create({{0.01, 0.0}, {0.06, 0.04}}, n);
}

TEST(Tessellate, A23_VerticesLieOnTheSurfaceWithTheirOpacity) {
  std::mt19937_64 random(60);
  const Frame frame = test::random_frame(random);
  for (const double n : {0.2, 0.5, 1.0, 2.0, 20.0}) {
    const Superellipse s = ellipse(n);
    const auto mesh = tessellate(dome(), frame, s);
    ASSERT_TRUE(mesh.ok());
    // |y'|^n at the tips of a star (n < 1) turns rounding of y' into as much as its n-th power.
    const double tolerance = n < 1 ? 2e-3 : 1e-9;
    double lowest = 1;
    for (std::size_t i = 0; i < mesh->vertex_count(); ++i) {
      const Vec3 local = frame.to_local(mesh->positions[i]);
      EXPECT_NEAR(local.z(), dome().value(local.x(), local.y()), 1e-12 * (1 + std::abs(local.z())));
      EXPECT_NEAR(mesh->normals[i].norm(), 1, 1e-12);
      EXPECT_NEAR(mesh->opacity[i], s.opacity(local.head<2>()), tolerance);
      EXPECT_LE(s.level(local.head<2>()), visible_level() + tolerance);
      lowest = std::min(lowest, mesh->opacity[i]);
    }
    EXPECT_LE(lowest, 1.0 / 255 + 1e-12) << "the last visible alpha is at the border";
  }
}

TEST(Tessellate, A23_BorderIsTheLastVisibleContour) {
  const auto mesh = tessellate(dome(), Frame{}, ellipse(2));
  const auto half_edges = to_trimesh(*mesh);
  ASSERT_TRUE(half_edges.ok());
  for (const auto v : half_edges->vertices()) {
    if (half_edges->is_boundary(v)) {
      EXPECT_NEAR(mesh->opacity[static_cast<std::size_t>(v.idx())], 1.0 / 255, 1e-12);
    }
  }
}

TEST(Tessellate, IsOneDiskSeenFromAbove) {
  for (const double n : {0.2, 1.0, 2.0, 20.0}) {
    const auto mesh = tessellate(dome(), Frame{}, ellipse(n));
    const auto half_edges = to_trimesh(*mesh);
    ASSERT_TRUE(half_edges.ok()) << half_edges.error().describe();
    const MeshTopology t = topology(*half_edges);
    EXPECT_EQ(t.euler_characteristic(), 1);
    EXPECT_EQ(t.components, 1U);
    EXPECT_EQ(t.boundary_loops, 1U);
    EXPECT_EQ(t.isolated_vertices, 0U);
    for (std::size_t i = 0; i < mesh->indices.size(); i += 3) {
      const Vec3& a = mesh->positions[mesh->indices[i]];
      const Vec3& b = mesh->positions[mesh->indices[i + 1]];
      const Vec3& c = mesh->positions[mesh->indices[i + 2]];
      EXPECT_GT((b - a).cross(c - a).z(), 0) << "n = " << n;
    }
  }
}

TEST(Tessellate, StaysWithinTheChordTolerance) {
  for (const double tolerance : {1e-3, 1e-4, 2e-5}) {
    TessellationOptions options;
    options.chord_tolerance_m = tolerance;
    options.max_divisions = 256;
    const auto mesh = tessellate(dome(), Frame{}, ellipse(2), options);
    ASSERT_TRUE(mesh.ok());
    double worst = 0;
    for (std::size_t i = 0; i < mesh->indices.size(); i += 3) {
      const Vec3 middle = (mesh->positions[mesh->indices[i]] + mesh->positions[mesh->indices[i + 1]] +
                           mesh->positions[mesh->indices[i + 2]]) /
                          3;
      worst = std::max(worst, std::abs(middle.z() - dome().value(middle.x(), middle.y())));
    }
    EXPECT_LE(worst, tolerance);
  }
}

TEST(Tessellate, A26_BoxModeCoversTheBoxOpaquely) {
  const Box2 box{{0.01, 0}, {0.06, 0.04}};
  const auto mesh = tessellate_box(dome(), Frame{}, box);
  ASSERT_TRUE(mesh.ok());
  double area = 0;
  for (std::size_t i = 0; i < mesh->indices.size(); i += 3) {
    const Vec3& a = mesh->positions[mesh->indices[i]];
    area +=
        (mesh->positions[mesh->indices[i + 1]] - a).cross(mesh->positions[mesh->indices[i + 2]] - a).z() / 2;
  }
  EXPECT_NEAR(area, 4 * 0.06 * 0.04, 1e-15);
  EXPECT_EQ(*std::min_element(mesh->opacity.begin(), mesh->opacity.end()), 1.0);
}

/// Largest difference between the opacity and its linear interpolation over the triangles, by `samples`
/// places each.
double opacity_error(const TriangleMesh& mesh, const Frame& frame, const TrimField& trim) {
  double worst = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const std::array corners{mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]};
    constexpr int steps = 6;
    for (int a = 0; a <= steps; ++a) {
      for (int b = 0; a + b <= steps; ++b) {
        const std::array weights{double(a) / steps, double(b) / steps, double(steps - a - b) / steps};
        Vec3 at = Vec3::Zero();
        double opacity = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          at += weights[k] * mesh.positions[corners[k]];
          opacity += weights[k] * mesh.opacity[corners[k]];
        }
        worst = std::max(worst, std::abs(opacity - trim.opacity(frame.to_local(at).head<2>())));
      }
    }
  }
  return worst;
}

double chord_error(const TriangleMesh& mesh, const PolynomialSurface& surface) {
  double worst = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3& a = mesh.positions[mesh.indices[i]];
    const Vec3& b = mesh.positions[mesh.indices[i + 1]];
    const Vec3& c = mesh.positions[mesh.indices[i + 2]];
    for (const Vec3& p : {Vec3((a + b + c) / 3), Vec3((a + b) / 2), Vec3((b + c) / 2), Vec3((c + a) / 2)}) {
      worst = std::max(worst, std::abs(p.z() - surface.value(p.x(), p.y())));
    }
  }
  return worst;
}

/// Sides that only one triangle has.
std::vector<std::pair<std::uint32_t, std::uint32_t>> border(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.indices[i + k];
      const std::uint32_t b = mesh.indices[i + (k + 1) % 3];
      EXPECT_NE(a, b);
      EXPECT_EQ((++sides[{a, b}]), 1) << "two triangles on the same side of an edge";
    }
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> open;
  for (const auto& [side, count] : sides) {
    if (!sides.contains({side.second, side.first})) open.push_back(side);
  }
  return open;
}

TrimField drawn(const std::vector<Vec2>& curve) {
  return std::make_shared<const BoundaryTrim>(*BoundaryTrim::create(curve));
}
TrimField drawn_circle(double radius) {
  std::vector<Vec2> curve;
  for (int i = 0; i <= 200; ++i) {
    const double angle = 2 * std::numbers::pi * i / 200;
    curve.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return drawn(curve);
}
/// A crescent about a bay, with an eight's crossing at the end.
TrimField drawn_bay() {
  return drawn({{-0.08, -0.03},
                {0.08, -0.03},
                {0.08, 0.04},
                {0.05, 0.04},
                {0.05, 0.0},
                {-0.05, 0.0},
                {-0.05, 0.05},
                {-0.08, 0.02},
                {-0.10, 0.05},
                {-0.08, -0.03}});
}

TEST(Tessellate, A22_A23_OpacityIsWithinItsTolerance) {
  for (const double n : {1.0, 1.5, 2.0, 3.0, 6.0, 20.0}) {
    for (const double tolerance : {0.1, 0.03, 0.01}) {
      TessellationOptions options;
      options.opacity_tolerance = tolerance;
      options.max_divisions = 256;
      const auto mesh = tessellate(dome(), Frame{}, ellipse(n), options);
      ASSERT_TRUE(mesh.ok());
      EXPECT_LE(opacity_error(*mesh, Frame{}, ellipse(n)), tolerance) << "n = " << n;
    }
    const auto mesh = tessellate(dome(), Frame{}, ellipse(n));
    EXPECT_LE(opacity_error(*mesh, Frame{}, ellipse(n)), TessellationOptions{}.opacity_tolerance) << n;
  }
}

TEST(Tessellate, A24_OpacityAndHeightAreWithinTheirTolerances) {
  for (const TrimField& trim : {drawn_circle(0.06), drawn_bay()}) {
    for (const double tolerance : {0.1, 0.03, 0.01}) {
      TessellationOptions options;
      options.opacity_tolerance = tolerance;
      options.max_vertices = 200'000;
      const auto mesh = tessellate(dome(), Frame{}, trim, options);
      ASSERT_TRUE(mesh.ok());
      // Sampled: where distances have a crease, triangles are judged at some places only.
      EXPECT_LE(opacity_error(*mesh, Frame{}, trim), 1.5 * tolerance);
      EXPECT_LE(chord_error(*mesh, dome()), options.chord_tolerance_m);
    }
  }
}

TEST(Tessellate, A24_NoCracksAndWideEnough) {
  // A crack, a vertex on another triangle's side, would make a border within what is seen.
  for (const TrimField& trim :
       {drawn_circle(0.06), drawn_bay(), TrimField(ellipse(20)), TrimField(ellipse(1))}) {
    for (const double tolerance : {1e-3, 1e-4, 1e-5}) {
      TessellationOptions options;
      options.chord_tolerance_m = tolerance;
      const auto mesh = tessellate(dome(), Frame{}, trim, options);
      ASSERT_TRUE(mesh.ok());
      for (const auto& [a, b] : border(*mesh)) {
        EXPECT_LE(mesh->opacity[a], faintest_opacity + 1e-12);
        EXPECT_LE(mesh->opacity[b], faintest_opacity + 1e-12);
      }
      for (std::size_t i = 0; i < mesh->indices.size(); i += 3) {
        const Vec3& a = mesh->positions[mesh->indices[i]];
        EXPECT_GT(
            (mesh->positions[mesh->indices[i + 1]] - a).cross(mesh->positions[mesh->indices[i + 2]] - a).z(),
            0);
      }
      for (std::size_t i = 0; i < mesh->vertex_count(); ++i) {
        EXPECT_NEAR(mesh->opacity[i], trim.opacity(mesh->positions[i].head<2>()), 1e-9);
      }
    }
  }
}

TEST(Tessellate, A24_FinerWhereOpacityChangesAndWhereTheSurfaceBends) {
  const auto smallest_side = [](const TriangleMesh& mesh, const Vec2& at) {
    double nearest = 1e300;
    double side = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const Vec2 a = mesh.positions[mesh.indices[i]].head<2>();
      const Vec2 b = mesh.positions[mesh.indices[i + 1]].head<2>();
      const Vec2 c = mesh.positions[mesh.indices[i + 2]].head<2>();
      const double away = ((a + b + c) / 3 - at).norm();
      if (away < nearest) {
        nearest = away;
        side = std::min({(a - b).norm(), (b - c).norm(), (c - a).norm()});
      }
    }
    return side;
  };
  const auto flat = PolynomialSurface::from_coefficients(1, std::array{0., 0., 0.});
  const auto fade = tessellate(*flat, Frame{}, drawn_circle(0.06));
  EXPECT_LT(smallest_side(*fade, {0.06, 0}), 0.6 * smallest_side(*fade, {0.001, 0.001}));
  // x^6 bends at its ends only.
  std::vector<double> sixth(28, 0.0);
  sixth[26] = 0.02;
  const auto bent = PolynomialSurface::from_scaled(6, {{0, 0}, {0.05, 0.05}}, sixth);
  TessellationOptions options;
  options.chord_tolerance_m = 2e-5;
  const auto drawn_mesh = tessellate(*bent, Frame{}, drawn_circle(0.06), options);
  EXPECT_LT(smallest_side(*drawn_mesh, {0.06, 0}), 0.5 * smallest_side(*drawn_mesh, {0, 0.06}));
  const TrimField circle = *Superellipse::create({{0, 0}, {0.05, 0.05}}, 2);
  const auto rings = tessellate(*bent, Frame{}, circle, options);
  EXPECT_LT(smallest_side(*rings, {0.06, 0}), 0.5 * smallest_side(*rings, {0.01, 0}));
}

TEST(Tessellate, A24_ManyMoreVerticesWouldBeNeededOnAGrid) {
  const TrimField trim = drawn_bay();
  const auto mesh = tessellate(dome(), Frame{}, trim);
  ASSERT_TRUE(mesh.ok());
  const double reached = opacity_error(*mesh, Frame{}, trim);
  // A grid with as many vertices over the same box.
  const auto side = static_cast<int>(std::sqrt(static_cast<double>(mesh->vertex_count())));
  const Box2 box = trim.visible_box();
  TriangleMesh grid;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const Vec2 xy = box.lower() + 2 * Vec2(i, j).cwiseProduct(box.half_extent) / (side - 1);
      grid.positions.push_back(dome().point(xy.x(), xy.y()));
      grid.opacity.push_back(trim.opacity(xy));
      if (i + 1 < side && j + 1 < side) {
        const auto a = static_cast<std::uint32_t>(i * side + j);
        const auto b = a + static_cast<std::uint32_t>(side);
        grid.indices.insert(grid.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
      }
    }
  }
  EXPECT_GT(opacity_error(grid, Frame{}, trim), 1.5 * reached);
}

TEST(Tessellate, A24_SizeIsBounded) {
  const auto wild = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 1e12, 1e12});
  const auto mesh = tessellate(*wild, Frame{}, drawn_circle(0.06));
  ASSERT_TRUE(mesh.ok());
  EXPECT_LE(mesh->vertex_count(), 3 * TessellationOptions{}.max_vertices);
  const auto overflow = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 1e308, 1e308});
  EXPECT_EQ(tessellate(*overflow, Frame{}, drawn_circle(1e10)).error().field, "surface");
  TessellationOptions options;
  options.max_vertices = std::size_t{1} << 40U;
  EXPECT_EQ(tessellate(dome(), Frame{}, ellipse(2), options).error().field, "max_vertices");
  options = {};
  options.opacity_tolerance = std::nan("");
  EXPECT_EQ(tessellate(dome(), Frame{}, ellipse(2), options).error().field, "opacity_tolerance");
}

TEST(Tessellate, BadInputIsRefusedAndSizeIsBounded) {
  TessellationOptions options;
  options.chord_tolerance_m = 0;
  EXPECT_EQ(tessellate(dome(), Frame{}, ellipse(2), options).error().field, "chord_tolerance_m");
  options = {};
  options.max_divisions = 1 << 30;
  EXPECT_EQ(tessellate(dome(), Frame{}, ellipse(2), options).error().field, "divisions");
  EXPECT_EQ(tessellate_box(dome(), Frame{}, {{0, 0}, {0, 0}}).error().field, "box");

  const auto wild = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 1e12, 1e12});
  const auto mesh = tessellate(*wild, Frame{}, ellipse(0.2));
  ASSERT_TRUE(mesh.ok());
  EXPECT_LE(mesh->vertex_count(), 4U * 48 * 62);
  const auto overflow = PolynomialSurface::from_coefficients(2, std::array{0., 0., 0., 0., 1e308, 1e308});
  const auto big = Superellipse::create({{0, 0}, {1e10, 1e10}}, 2);
  EXPECT_EQ(tessellate(*overflow, Frame{}, *big).error().field, "surface");
}

}  // namespace
}  // namespace handloft::geometry
