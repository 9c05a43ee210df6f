// Tessellation of B-spline surfaces: chord error as measured, closed seams and poles, loops kept, and meshes
// of dragged surfaces that are updated.

#include "server-model/geometry/bspline_tessellate.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <map>
#include <numeric>

#include "server-model/geometry/bspline_projection.h"
#include "server-model/geometry/constrained_delaunay.h"
#include "server-model/geometry/grid_tessellation.h"
#include "server-model/geometry/trimesh.h"
#include "tests/unit/server-model/geometry/bspline_shapes.h"

namespace handloft::geometry {
namespace {

using samples::Random;
using samples::uniform;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

SurfaceMeshOptions within(double tolerance) {
  SurfaceMeshOptions options;
  options.chord_tolerance_m = tolerance;
  return options;
}

SurfaceMeshOptions as_given(double tolerance) {
  SurfaceMeshOptions options = within(tolerance);
  options.loop_places = SurfaceMeshOptions::LoopPlaces::as_given;
  return options;
}

/// The largest distance of places in triangles (middles, sides' middles) from the surface.
double chord_error(const BSplineSurface& surface, const TriangleMesh& mesh) {
  const SurfaceProjector projector = *SurfaceProjector::create(surface);
  double worst = 0;
  const auto see = [&](const Vec3& p) { worst = std::max(worst, projector.closest(p)->distance_m); };
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const Vec3 &a = mesh.positions[mesh.indices[3 * t]], &b = mesh.positions[mesh.indices[3 * t + 1]],
               &c = mesh.positions[mesh.indices[3 * t + 2]];
    see((a + b + c) / 3);
    see((a + b) / 2);
    see((b + c) / 2);
  }
  return worst;
}

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const Vec3 &a = mesh.positions[mesh.indices[3 * t]], &b = mesh.positions[mesh.indices[3 * t + 1]],
               &c = mesh.positions[mesh.indices[3 * t + 2]];
    sum += (b - a).cross(c - a).norm() / 2;
  }
  return sum;
}

MeshTopology topology_of(const TriangleMesh& mesh) {
  const auto built = to_trimesh(mesh);
  EXPECT_TRUE(built.ok()) << (built.ok() ? "" : built.error().describe());
  return built.ok() ? topology(*built) : MeshTopology{};
}

void expect_usable(const TriangleMesh& mesh) {
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  ASSERT_EQ(mesh.opacity, std::vector<double>(mesh.positions.size(), 1));
  for (const Vec3& n : mesh.normals) ASSERT_NEAR(n.norm(), 1, 1e-12);
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const Vec3 &a = mesh.positions[mesh.indices[3 * t]], &b = mesh.positions[mesh.indices[3 * t + 1]],
               &c = mesh.positions[mesh.indices[3 * t + 2]];
    // The triangles' side is the normals'.
    ASSERT_GT((b - a).cross(c - a).dot(mesh.normals[mesh.indices[3 * t]]), 0) << t;
  }
}

TEST(BSplineTessellate, ChordErrorKeepsToTheTolerance) {
  std::size_t coarser = 0;
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    const BSplineSurface surface = samples::wavy(12, 12);
    const TriangleMesh mesh = *tessellate(surface, within(tolerance));
    expect_usable(mesh);
    EXPECT_LT(chord_error(surface, mesh), tolerance);
    EXPECT_GT(mesh.triangle_count(), coarser);
    coarser = mesh.triangle_count();
    const MeshTopology shape = topology_of(mesh);
    EXPECT_EQ(shape.euler_characteristic(), 1);
    EXPECT_EQ(shape.boundary_loops, 1U);
    EXPECT_EQ(shape.isolated_vertices, 0U);
  }
}

// Few triangles where it is flat, many at the bump: that is what adaptive means.
TEST(BSplineTessellate, FineWhereItBendsOnly) {
  BSplineSurface surface = samples::flat(1, 1, 30, 30);
  EXPECT_EQ(tessellate(surface, within(1e-4))->triangle_count(), 2U);
  surface.control[surface.index(7, 7)].z() = 0.02;
  const TriangleMesh mesh = *tessellate(surface, within(1e-4));
  std::size_t near = 0;
  for (const Vec3& p : mesh.positions) near += (p - surface.at(7, 7)).norm() < 0.15 ? 1 : 0;
  EXPECT_GT(near, mesh.vertex_count() * 2 / 3);
  EXPECT_LT(chord_error(surface, mesh), 1e-4);
  EXPECT_EQ(topology_of(mesh).euler_characteristic(), 1);
}

TEST(BSplineTessellate, ClosedSurfacesAreClosed) {
  for (const double tolerance : {1e-1, 1e-2, 1e-3}) {
    const TriangleMesh ball = *tessellate(samples::sphere(0.5), within(tolerance));
    expect_usable(ball);
    const MeshTopology sphere = topology_of(ball);
    EXPECT_EQ(sphere.euler_characteristic(), 2);
    EXPECT_EQ(sphere.boundary_loops, 0U);
    for (std::size_t t = 0; t < ball.triangle_count(); ++t) {
      const Vec3 middle = (ball.positions[ball.indices[3 * t]] + ball.positions[ball.indices[3 * t + 1]] +
                           ball.positions[ball.indices[3 * t + 2]]) /
                          3;
      ASSERT_LT(0.5 - middle.norm(), tolerance);
    }
    const MeshTopology torus = topology_of(*tessellate(samples::torus(1, 0.3), within(tolerance)));
    EXPECT_EQ(torus.euler_characteristic(), 0);
    EXPECT_EQ(torus.boundary_loops, 0U);
    const MeshTopology vase = topology_of(*tessellate(samples::vase(12, 8), within(tolerance)));
    EXPECT_EQ(vase.euler_characteristic(), 0);
    EXPECT_EQ(vase.boundary_loops, 2U);
    EXPECT_EQ(vase.components, 1U);
  }
  EXPECT_NEAR(area(*tessellate(samples::sphere(0.5), within(1e-4))), M_PI, 2e-3);
}

TEST(BSplineTessellate, CreasesAreNotCutOff) {
  // A roof: degree 1 across, cubic along.
  BSplineSurface surface{
      KnotVector::open(1, {0, 0, 0.37, 1, 1}).value(), KnotVector::uniform(3, 6).value(), {}, {}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 6; ++j) surface.control.emplace_back(0.5 * i, 0.2 * j, i == 1 ? 0.4 : 0.0);
  }
  EXPECT_LT(chord_error(surface, *tessellate(surface, within(1e-4))), 1e-6);
  const TrimLoop loop = {{0.1, 0.1}, {0.9, 0.2}, {0.8, 0.9}, {0.2, 0.7}};
  EXPECT_LT(chord_error(surface, *tessellate(surface, {loop}, within(1e-4))), 1e-4);
}

TEST(BSplineTessellate, RandomSurfacesOfEveryKind) {
  Random random(1);
  for (const samples::Kind u : samples::kinds) {
    for (const samples::Weights weights : {samples::Weights::none, samples::Weights::random}) {
      const BSplineSurface surface = samples::random_surface(random, u, samples::Kind::clamped,
                                                             1 + static_cast<int>(random() % 3), 3, weights);
      const TriangleMesh mesh = *tessellate(surface, within(0.02));
      const MeshTopology shape = topology_of(mesh);
      EXPECT_EQ(shape.euler_characteristic(), u == samples::Kind::periodic ? 0 : 1);
      EXPECT_EQ(shape.isolated_vertices, 0U);
      Random places(2);
      const SurfaceProjector projector = *SurfaceProjector::create(surface);
      for (int k = 0; k < 300; ++k) {
        const std::size_t t = places() % mesh.triangle_count();
        const Vec3 middle = (mesh.positions[mesh.indices[3 * t]] + mesh.positions[mesh.indices[3 * t + 1]] +
                             mesh.positions[mesh.indices[3 * t + 2]]) /
                            3;
        EXPECT_LT(projector.closest(middle)->distance_m, 0.02);
      }
    }
  }
}

TrimLoop square(double low, double high) {
  return {{low, low}, {high, low}, {high, high}, {low, high}};
}

TrimLoop round_loop(const Vec2& centre, double radius, int n) {
  TrimLoop loop;
  for (int k = 0; k < n; ++k) {
    const double turn = 2 * M_PI * k / n;
    loop.emplace_back(centre + radius * Vec2(std::cos(turn), std::sin(turn)));
  }
  return loop;
}

double polygon_area(const TrimLoop& loop) {
  double twice = 0;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const Vec2 &a = loop[k], &b = loop[(k + 1) % loop.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2;
}

// D: trims are kept. On a plane the mesh's area is the polygons'.
TEST(BSplineTessellate, HolesAreKept) {
  const BSplineSurface plane = samples::flat(1, 1, 12, 12);
  const TrimLoop rim = round_loop({0.5, 0.5}, 0.45, 61), hole = square(0.3, 0.41);
  const TrimLoop second = round_loop({0.62, 0.6}, 0.1, 17), island = round_loop({0.62, 0.6}, 0.05, 9);
  const TriangleMesh mesh = *tessellate(plane, {rim, hole, second, island}, within(1e-3));
  expect_usable(mesh);
  EXPECT_NEAR(area(mesh),
              polygon_area(rim) - polygon_area(hole) - polygon_area(second) + polygon_area(island), 1e-12);
  const MeshTopology shape = topology_of(mesh);
  EXPECT_EQ(shape.components, 2U);
  EXPECT_EQ(shape.boundary_loops, 4U);
}

TEST(BSplineTessellate, TrimmedBentSurfacesKeepToTheTolerance) {
  const BSplineSurface surface = samples::wavy(14, 14);
  const TriangleMesh mesh =
      *tessellate(surface, {round_loop({0.5, 0.5}, 0.4, 9), square(0.4, 0.6)}, within(1e-4));
  expect_usable(mesh);
  EXPECT_LT(chord_error(surface, mesh), 1e-4);
  const MeshTopology shape = topology_of(mesh);
  EXPECT_EQ(shape.euler_characteristic(), 0);
  EXPECT_EQ(shape.boundary_loops, 2U);
}

/// Vertices on the mesh's open sides.
std::vector<Vec3> rim_of(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (std::size_t k = 0; k < mesh.indices.size(); ++k) {
    const std::uint32_t a = mesh.indices[k], b = mesh.indices[k % 3 == 2 ? k - 2 : k + 1];
    ++sides[std::minmax(a, b)];
  }
  std::vector<Vec3> places;
  for (const auto& [side, times] : sides) {
    if (times == 1)
      places.push_back(mesh.positions[side.first]), places.push_back(mesh.positions[side.second]);
  }
  return places;
}

// Two faces of one surface that share a bent edge: the same places, so the same vertices on both.
TEST(BSplineTessellate, FacesThatShareAnEdgeHaveTheSameVerticesThere) {
  const BSplineSurface surface = samples::wavy(14, 14);
  const TrimLoop left = *refined_loop(surface, {{0, 0}, {0.5, 0}, {0.45, 1}, {0, 1}}, 1e-4);
  TrimLoop right;  // The shared edge reversed, then around.
  for (auto p = left.rbegin(); p != left.rend(); ++p) {
    if (p->x() >= 0.45 - 1e-12 && p->x() <= 0.5 + 1e-12 && std::abs(p->x() - (0.5 - 0.05 * p->y())) < 1e-12) {
      right.push_back(*p);
    }
  }
  ASSERT_GT(right.size(), 8U);
  EXPECT_EQ(right.front(), Vec2(0.45, 1));
  right.emplace_back(1, 0);
  right.emplace_back(1, 1);
  const TriangleMesh a = *tessellate(surface, {left}, as_given(1e-4));
  const TriangleMesh b = *tessellate(surface, {right}, as_given(1e-4));
  std::size_t shared = 0;
  const std::vector<Vec3> rim_a = rim_of(a), rim_b = rim_of(b);
  for (const Vec2& uv : left) {
    if (std::find(right.begin(), right.end(), uv) == right.end()) continue;
    const Vec3 place = surface.evaluate(uv.x(), uv.y());
    EXPECT_NE(std::find(rim_a.begin(), rim_a.end(), place), rim_a.end());
    EXPECT_NE(std::find(rim_b.begin(), rim_b.end(), place), rim_b.end());
    ++shared;
  }
  EXPECT_EQ(shared, right.size() - 2);
  // And no others: as many sides as places.
  EXPECT_EQ(rim_a.size() / 2, left.size());
  EXPECT_EQ(rim_b.size() / 2, right.size());
}

TEST(BSplineTessellate, PrescribedEdgesOfAWholeSurface) {
  const BSplineSurface surface = samples::wavy(10, 10);
  TrimLoop loop;
  for (int k = 0; k < 7; ++k) loop.emplace_back(k / 7.0, 0);
  for (int k = 0; k < 3; ++k) loop.emplace_back(1, k / 3.0);
  loop.emplace_back(1, 1);
  loop.emplace_back(0, 1);
  const TriangleMesh mesh = *tessellate(surface, {loop}, as_given(1e-3));
  EXPECT_EQ(rim_of(mesh).size() / 2, loop.size());
  EXPECT_EQ(topology_of(mesh).boundary_loops, 1U);
}

TEST(BSplineTessellate, RandomLoopsKeepTheirArea) {
  Random random(3);
  const BSplineSurface plane = samples::flat(1, 1, 8, 8);
  for (int k = 0; k < 60; ++k) {
    TrimLoop star;  // Around its middle, so that it does not cross itself.
    const int n = 3 + static_cast<int>(random() % 60);
    for (int i = 0; i < n; ++i) {
      const double turn = 2 * M_PI * i / n, radius = uniform(random, 0.02, 0.5);
      star.emplace_back(0.5 + radius * std::cos(turn), 0.5 + radius * std::sin(turn));
    }
    const auto mesh = tessellate(plane, {star}, within(1e-2));
    ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
    ASSERT_NEAR(area(*mesh), polygon_area(star), 1e-9);
    ASSERT_EQ(topology_of(*mesh).euler_characteristic(), 1) << k;
  }
}

TEST(BSplineTessellate, RefusesWhatMakesNoMesh) {
  const BSplineSurface surface = samples::wavy(8, 8);
  const auto field = [](const Result<TriangleMesh>& mesh) {
    return mesh.ok() ? std::string() : mesh.error().field;
  };
  EXPECT_EQ(field(tessellate(surface, within(0))), "chord_tolerance_m");
  EXPECT_EQ(field(tessellate(surface, within(nan))), "chord_tolerance_m");
  EXPECT_EQ(field(tessellate(surface, {{{0, 0}, {1, 0.9}, {1, 0}, {0, 0.6}}}, within(1e-3))),
            "loops");  // An eight.
  EXPECT_EQ(field(tessellate(surface, {{{0, 0}, {1, 1}, {1, nan}}}, within(1e-3))), "loops[0][2]");
  EXPECT_EQ(field(tessellate(surface, std::vector<TrimLoop>{}, within(1e-3))), "loops");
  SurfaceMeshOptions few = within(1e-9);
  few.max_vertices = 500;
  EXPECT_LT(tessellate(surface, few)->vertex_count(), 1500U);  // It stops; no tolerance asks for millions.
}

// All places on circles with others, constraints through places and across many triangles.
TEST(ConstrainedDelaunayTest, GridsAndLongConstraints) {
  ConstrainedDelaunay mesh({0, 0}, {1, 1}, {1, 1});
  constexpr std::uint32_t n = 17;
  for (std::uint32_t k = 0; k < n * n; ++k) {
    ASSERT_EQ(mesh.insert(Vec2(k / n, k % n) / (n - 1)), k);
  }
  EXPECT_EQ(mesh.insert(Vec2(0.5, 0.5)), n * n / 2);  // It is there already.
  const auto at = [](std::uint32_t i, std::uint32_t j) { return i * n + j; };
  ASSERT_TRUE(mesh.constrain(at(0, 0), at(16, 0)));
  ASSERT_TRUE(mesh.constrain(at(16, 0), at(16, 16)));
  ASSERT_TRUE(mesh.constrain(at(16, 16), at(0, 0)));  // Through all places of the diagonal.
  EXPECT_EQ(mesh.inside().size(), 16U * 16U);
  EXPECT_TRUE(mesh.constrain(at(16, 15), at(1, 0)));  // Along the diagonal, inside.
  EXPECT_FALSE(mesh.constrain(at(0, 3), at(9, 2)));   // Across it.
  EXPECT_EQ(mesh.insert(Vec2(0.53, 0.53)), ConstrainedDelaunay::none);
}

TEST(ConstrainedDelaunayTest, RandomConstraintsKeepTheArea) {
  Random random(6);
  for (int round = 0; round < 20; ++round) {
    ConstrainedDelaunay mesh({-2, 1}, {3, 2}, {1, 3});
    std::vector<Vec2> places = {{-2, 1}, {3, 1}, {3, 2}, {-2, 2}};
    for (int k = 0; k < 200; ++k) places.emplace_back(uniform(random, -1.9, 2.9), uniform(random, 1.1, 1.9));
    for (const Vec2& uv : places) ASSERT_NE(mesh.insert(uv), ConstrainedDelaunay::none);
    for (std::uint32_t k = 0; k < 4; ++k) ASSERT_TRUE(mesh.constrain(k, (k + 1) % 4));
    // From left to right, up and down across many triangles, twice: an even number of times counts as none
    // for inside and outside.
    std::vector<std::uint32_t> order(200);
    std::iota(order.begin(), order.end(), 4U);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return places[a].x() < places[b].x(); });
    for (std::size_t k = 0; k + 1 < order.size(); ++k) {
      ASSERT_TRUE(mesh.constrain(order[k], order[k + 1]));
      ASSERT_TRUE(mesh.constrain(order[k + 1], order[k]));
    }
    double sum = 0;
    for (const auto& [a, b, c] : mesh.inside()) {
      const Vec2 ab = places[b] - places[a], ac = places[c] - places[a];
      sum += (ab.x() * ac.y() - ab.y() * ac.x()) / 2;
      ASSERT_GT(ab.x() * ac.y() - ab.y() * ac.x(), 0);
    }
    ASSERT_NEAR(sum, 5, 1e-9);
  }
}

// --- Meshes of dragged surfaces.

TEST(GridTessellation, IsTheSurfaceAtItsParameters) {
  for (const bool rational : {false, true}) {
    BSplineSurface surface = samples::wavy(12, 9);
    if (rational) {
      Random random(4);
      surface.weights = samples::random_weights(random, surface.control.size(), samples::Weights::random);
    }
    const GridParameters grid = even_grid(surface, 2);
    const GridTessellation mesh = *GridTessellation::create(surface, grid);
    expect_usable(mesh.mesh());
    EXPECT_EQ(mesh.mesh().triangle_count(), 2 * (grid.us.size() - 1) * (grid.vs.size() - 1));
    for (std::size_t r = 0; r < grid.us.size(); ++r) {
      for (std::size_t c = 0; c < grid.vs.size(); ++c) {
        const std::size_t vertex = r * mesh.columns() + c;
        ASSERT_LT((mesh.mesh().positions[vertex] - surface.evaluate(grid.us[r], grid.vs[c])).norm(), 1e-14);
        ASSERT_LT((mesh.mesh().normals[vertex] - surface.normal(grid.us[r], grid.vs[c])).norm(), 1e-12);
      }
    }
  }
}

TEST(GridTessellation, UpdatesEqualMakingItAnewToTheBit) {
  Random random(5);
  for (const samples::Kind kind : samples::kinds) {
    for (const samples::Weights weights : {samples::Weights::none, samples::Weights::random}) {
      BSplineSurface surface = samples::random_surface(random, kind, samples::Kind::clamped, 3, 2, weights);
      const GridParameters grid = even_grid(surface, 3);
      GridTessellation kept = *GridTessellation::create(surface, grid);
      for (int frame = 0; frame < 20; ++frame) {
        const std::vector<Vec3> before = kept.mesh().positions;
        for (std::size_t k = 0; k <= random() % 3; ++k) {
          surface.control[random() % surface.control.size()] += Vec3(0.01, uniform(random, -0.1, 0.1), 0.02);
        }
        ASSERT_TRUE(kept.update(surface.control).ok());
        const GridTessellation fresh = *GridTessellation::create(surface, grid);
        ASSERT_EQ(kept.mesh().positions, fresh.mesh().positions);
        ASSERT_EQ(kept.mesh().normals, fresh.mesh().normals);
        // Whoever moved is named.
        std::vector<std::uint8_t> named(before.size());
        for (const std::uint32_t vertex : kept.changed()) named[vertex] = 1;
        for (std::size_t k = 0; k < before.size(); ++k) {
          if (named[k] == 0) {
            ASSERT_EQ(before[k], kept.mesh().positions[k]);
          }
        }
      }
      ASSERT_TRUE(kept.update(surface.control).ok());
      EXPECT_TRUE(kept.changed().empty());
    }
  }
}

TEST(GridTessellation, OnePointChangesItsNeighbourhoodOnly) {
  BSplineSurface surface = samples::flat(1, 1, 40, 40);
  GridTessellation mesh = *GridTessellation::create(surface, even_grid(surface, 1));
  EXPECT_EQ(mesh.changed().size(), mesh.mesh().vertex_count());
  std::vector<Vec3> displacements(surface.control.size(), Vec3::Zero());
  displacements[surface.index(20, 20)].z() = 0.1;
  ASSERT_TRUE(mesh.update(surface.control, displacements).ok());
  EXPECT_LE(mesh.changed().size(), 25U);  // Four spans a direction, their ends with them.
  EXPECT_GE(mesh.changed().size(), 9U);
}

TEST(GridTessellation, PeriodicSeamsAreClosed) {
  const BSplineSurface surface = samples::vase(12, 8);
  const GridTessellation mesh = *GridTessellation::create(surface, even_grid(surface, 2));
  const MeshTopology shape = topology_of(mesh.mesh());
  EXPECT_EQ(shape.euler_characteristic(), 0);
  EXPECT_EQ(shape.boundary_loops, 2U);
}

TEST(GridTessellation, GridsWithinATolerance) {
  const BSplineSurface surface = samples::wavy(12, 12);
  const GridParameters grid = *grid_within(surface, 1e-4);
  EXPECT_LT(chord_error(surface, GridTessellation::create(surface, grid)->mesh()), 1e-4);
  EXPECT_FALSE(grid_within(surface, 1e-12).ok());
  EXPECT_FALSE(grid_within(surface, nan).ok());
}

TEST(GridTessellation, RefusesWhatIsNoGrid) {
  const BSplineSurface surface = samples::wavy(8, 8);
  EXPECT_EQ(GridTessellation::create(surface, {{0}, {0, 1}}).error().field, "us");
  EXPECT_EQ(GridTessellation::create(surface, {{0, 1}, {0, 0.5, 0.5}}).error().field, "vs[2]");
  EXPECT_EQ(GridTessellation::create(surface, {{0, nan}, {0, 1}}).error().field, "us[1]");
  GridTessellation mesh = *GridTessellation::create(surface, even_grid(surface, 1));
  std::vector<Vec3> control = surface.control;
  const std::vector<Vec3> before = mesh.mesh().positions;
  for (Vec3& point : control) point.z() += 0.25;
  control[4].y() = nan;
  EXPECT_EQ(mesh.update(control).error().field, "control[4]");
  EXPECT_EQ(mesh.mesh().positions, before);
  // What the refused one had taken does not pass for known.
  control[4] = surface.control[4];
  ASSERT_TRUE(mesh.update(control).ok());
  BSplineSurface moved = surface;
  moved.control = control;
  EXPECT_EQ(mesh.mesh().positions, GridTessellation::create(moved, even_grid(moved, 1))->mesh().positions);
  EXPECT_EQ(mesh.update(std::span(control).first(3)).error().field, "control");
}

}  // namespace
}  // namespace handloft::geometry
