// Curvatures of meshes against those of the surfaces that they approximate (V3).

#include "client-hmd/render/curvature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "client-hmd/render/curvature_map.h"
#include "client-hmd/render/curvature_worker.h"
#include "common/codec/mesh_codec.h"

namespace handloft::client {
namespace {

struct Sample {
  glm::dvec3 position, normal;
  double largest = 0.0, smallest = 0.0;
};

struct Patch {
  SurfaceMesh mesh;
  std::vector<Sample> truth;
  int columns = 0, rows = 0;
  bool is_inner(std::size_t i, int border) const {
    const int row = static_cast<int>(i) / columns, column = static_cast<int>(i) % columns;
    return row >= border && column >= border && row < rows - border && column < columns - border;
  }
};

enum class Normals { exact, as_on_the_wire };

/// n x n vertices over 0..1 squared.
Patch patch_of(int n, const std::function<Sample(double, double)>& surface, Normals normals) {
  Patch patch;
  patch.columns = patch.rows = n;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const Sample sample = surface(static_cast<double>(i) / (n - 1), static_cast<double>(j) / (n - 1));
      std::array<float, 3> normal{static_cast<float>(sample.normal.x), static_cast<float>(sample.normal.y),
                                  static_cast<float>(sample.normal.z)};
      if (normals == Normals::as_on_the_wire) {
        const auto code = codec::encode_octahedral(normal);
        normal = codec::decode_octahedral(code[0], code[1]);
      }
      patch.mesh.vertices.push_back(
          {{static_cast<float>(sample.position.x), static_cast<float>(sample.position.y),
            static_cast<float>(sample.position.z)},
           {normal[0], normal[1], normal[2]},
           1.0F});
      patch.truth.push_back(sample);
    }
  }
  const auto at = [n](int i, int j) { return static_cast<std::uint32_t>(j * n + i); };
  for (int j = 0; j + 1 < n; ++j) {
    for (int i = 0; i + 1 < n; ++i) {
      patch.mesh.indices.insert(patch.mesh.indices.end(), {at(i, j), at(i + 1, j), at(i, j + 1), at(i, j + 1),
                                                           at(i + 1, j), at(i + 1, j + 1)});
    }
  }
  return patch;
}

/// Largest error of either principal curvature, inside of the border, relative to the largest true one.
double relative_error(const Patch& patch, const CurvatureOptions& options = {}, int border = 3) {
  const auto found = vertex_curvatures(patch.mesh.vertices, patch.mesh.indices, options);
  EXPECT_EQ(found.size(), patch.truth.size());
  double error = 0.0, scale = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Sample& truth = patch.truth[i];
    scale = std::max({scale, std::abs(truth.largest), std::abs(truth.smallest)});
    if (!patch.is_inner(i, border)) continue;
    error = std::max(
        {error, std::abs(found[i].largest - truth.largest), std::abs(found[i].smallest - truth.smallest)});
  }
  return error / scale;
}

Sample ball(double u, double v) {
  constexpr double radius = 0.05;
  const double a = 0.4 + 1.2 * u, b = -0.6 + 1.2 * v;
  const glm::dvec3 n(std::cos(b) * std::cos(a), std::cos(b) * std::sin(a), std::sin(b));
  return {radius * n, n, 1.0 / radius, 1.0 / radius};
}

Sample pipe(double u, double v) {
  constexpr double radius = 0.03;
  const glm::dvec3 n(std::cos(1.5 * u), std::sin(1.5 * u), 0.0);
  return {radius * n + glm::dvec3(0.0, 0.0, 0.06 * v), n, 1.0 / radius, 0.0};
}

Sample ring(double u, double v) {
  constexpr double large = 0.05, small = 0.02;
  const double a = 1.2 * u, b = 6.283185307179586 * v;
  const glm::dvec3 out(std::cos(a), std::sin(a), 0.0);
  const glm::dvec3 n = std::cos(b) * out + std::sin(b) * glm::dvec3(0.0, 0.0, 1.0);
  const double around = std::cos(b) / (large + small * std::cos(b));
  return {large * out + small * n, n, std::max(1.0 / small, around), std::min(1.0 / small, around)};
}

/// z = (x^2 - y^2) * 8: curvatures from the fundamental forms of a graph.
Sample saddle(double u, double v) {
  const double x = 0.08 * (u - 0.5), y = 0.08 * (v - 0.5), c = 8.0;
  const double p = 2.0 * c * x, q = -2.0 * c * y, w = std::sqrt(1.0 + p * p + q * q);
  const glm::dvec3 n(-p / w, -q / w, 1.0 / w);
  // Positive is bent away from the normal: the negative of the usual second form of a graph.
  const double l = -2.0 * c / w, m = 0.0, o = 2.0 * c / w;
  const double e = 1.0 + p * p, f = p * q, g = 1.0 + q * q, area = e * g - f * f;
  const double gauss = (l * o - m * m) / area;
  const double mean = (l * g - 2.0 * m * f + o * e) / (2.0 * area);
  const double spread = std::sqrt(std::max(0.0, mean * mean - gauss));
  return {{x, y, c * (x * x - y * y)}, n, mean + spread, mean - spread};
}

TEST(Curvature, IsThatOfTheSurfaceWithinAPercent_V3) {
  const CurvatureOptions plain{.max_smoothing = 0};
  EXPECT_LT(relative_error(patch_of(61, ball, Normals::exact), plain), 0.002);
  EXPECT_LT(relative_error(patch_of(61, pipe, Normals::exact), plain), 0.002);
  EXPECT_LT(relative_error(patch_of(81, ring, Normals::exact), plain), 0.01);
  EXPECT_LT(relative_error(patch_of(61, saddle, Normals::exact), plain), 0.01);
}

TEST(Curvature, ConvergesWithTheSquareOfTheEdges) {
  const CurvatureOptions plain{.max_smoothing = 0};
  const double coarse = relative_error(patch_of(21, saddle, Normals::exact), plain, 2);
  const double fine = relative_error(patch_of(41, saddle, Normals::exact), plain, 4);
  EXPECT_LT(fine, 0.6 * coarse) << coarse << " " << fine;
}

TEST(Curvature, StandsNormalsOfTwelveBits) {
  // Edges of about a millimetre, as the server sends them.
  EXPECT_LT(relative_error(patch_of(61, ball, Normals::as_on_the_wire)), 0.05);
  EXPECT_LT(relative_error(patch_of(61, pipe, Normals::as_on_the_wire)), 0.05);
  EXPECT_LT(relative_error(patch_of(81, ring, Normals::as_on_the_wire)), 0.05);
  EXPECT_LT(relative_error(patch_of(61, saddle, Normals::as_on_the_wire), {}, 4), 0.06);
}

TEST(Curvature, IsSmoothedWhereShortEdgesMakeRoundedNormalsNoisy) {
  // Edges of 0.12 mm: without smoothing the noise is of the order of the curvature.
  const Patch patch = patch_of(301, pipe, Normals::as_on_the_wire);
  const double raw = relative_error(patch, {.max_smoothing = 0}, 12);
  const double smoothed = relative_error(patch, {}, 12);
  EXPECT_GT(raw, 0.05) << "or the test is void";
  EXPECT_LT(smoothed, 0.6 * raw) << raw << " " << smoothed;
}

TEST(Curvature, SignsFollowTheNormalsNotTheWinding) {
  Patch patch = patch_of(21, ball, Normals::exact);
  for (std::size_t i = 0; i < patch.mesh.indices.size(); i += 3) {
    std::swap(patch.mesh.indices[i], patch.mesh.indices[i + 1]);
  }
  EXPECT_GT(vertex_curvatures(patch.mesh.vertices, patch.mesh.indices)[220].smallest, 15.0F);
  for (SurfaceVertex& vertex : patch.mesh.vertices) {
    vertex.normal = {-vertex.normal.x, -vertex.normal.y, -vertex.normal.z};
  }
  EXPECT_LT(vertex_curvatures(patch.mesh.vertices, patch.mesh.indices)[220].largest, -15.0F)
      << "from inside a ball is hollow";
}

TEST(Curvature, IsANumberWhateverTheMesh) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(vertex_curvatures({}, {}).empty());
  // A point, a sliver, a triangle of noughts, one of NaN, an index out of range, and a lone vertex.
  const std::vector<SurfaceVertex> vertices{{{0, 0, 0}, {0, 0, 1}, 1},     {{1, 0, 0}, {0, 0, 1}, 1},
                                            {{1, 1e-9F, 0}, {0, 0, 1}, 1}, {{0, 1, 0}, {0, 0, 0}, 1},
                                            {{nan, 0, 0}, {nan, 0, 1}, 1}, {{0, 0, 1}, {0, 0, -1}, 1},
                                            {{3e38F, 0, 0}, {0, 0, 1}, 1}};
  const std::vector<std::uint32_t> indices{0, 0, 0, 0, 1, 2, 0, 1, 3, 0, 1, 4, 0, 1, 99, 0, 1, 5, 0, 3, 6, 1};
  for (const PrincipalCurvatures& found : vertex_curvatures(vertices, indices)) {
    EXPECT_TRUE(std::isfinite(found.largest));
    EXPECT_TRUE(std::isfinite(found.smallest));
    EXPECT_GE(found.largest, found.smallest);
  }
}

TEST(Curvature, KindsComeFromThePrincipalOnes) {
  const PrincipalCurvatures saddle_point{8.0F, -2.0F};
  EXPECT_FLOAT_EQ(curvature_value(saddle_point, CurvatureKind::mean), 3.0F);
  EXPECT_FLOAT_EQ(curvature_value(saddle_point, CurvatureKind::gaussian), -4.0F) << "root of 16, a saddle";
  EXPECT_FLOAT_EQ(curvature_value(saddle_point, CurvatureKind::largest), 8.0F);
  EXPECT_FLOAT_EQ(curvature_value(saddle_point, CurvatureKind::smallest), -2.0F);
}

TEST(Curvature, RangeHoldsMostOfWhatIsSeenAndIsPlain) {
  std::vector<PrincipalCurvatures> curvatures;
  std::vector<SurfaceVertex> vertices;
  for (int i = 1; i <= 100; ++i) {
    curvatures.push_back({static_cast<float>(i), 0.0F});
    vertices.push_back({{}, {0, 0, 1}, 1.0F});
  }
  EXPECT_FLOAT_EQ(curvature_range(curvatures, vertices, CurvatureKind::largest), 100.0F) << "95 and up";
  EXPECT_FLOAT_EQ(curvature_range(curvatures, vertices, CurvatureKind::largest, 0.45F), 50.0F);
  for (std::size_t i = 10; i < vertices.size(); ++i) vertices[i].opacity = 0.4F;
  EXPECT_FLOAT_EQ(curvature_range(curvatures, vertices, CurvatureKind::largest), 10.0F);
  EXPECT_FLOAT_EQ(curvature_range({}, {}, CurvatureKind::mean), 0.1F);
  EXPECT_FLOAT_EQ(plain_number_above(0.0F), 0.1F);
  EXPECT_FLOAT_EQ(plain_number_above(21.0F), 30.0F);
  EXPECT_FLOAT_EQ(plain_number_above(0.76F), 1.0F);
  EXPECT_FLOAT_EQ(plain_number_above(std::numeric_limits<float>::quiet_NaN()), 0.1F);
  EXPECT_TRUE(std::isfinite(plain_number_above(std::numeric_limits<float>::infinity())));
}

TEST(CurvatureWorker, HasTheNewestMeshOfEachEntity) {
  CurvatureWorker worker;
  EXPECT_EQ(worker.newest("a"), nullptr);
  const auto first = std::make_shared<const SurfaceMesh>(patch_of(11, ball, Normals::exact).mesh);
  const auto second = std::make_shared<const SurfaceMesh>(patch_of(13, pipe, Normals::exact).mesh);
  for (int i = 0; i < 20; ++i) worker.want("a", i % 2 == 0 ? first : second);
  worker.want("b", first);
  worker.want("c", first);
  worker.keep_only([](const std::string& id) { return id != "c"; });
  worker.wait();
  ASSERT_NE(worker.newest("a"), nullptr);
  EXPECT_EQ(worker.newest("a")->mesh, second) << "the last one that was wanted";
  EXPECT_EQ(worker.newest("a")->values.size(), second->vertices.size());
  EXPECT_FLOAT_EQ(worker.newest("b")->range_per_m[static_cast<std::size_t>(CurvatureKind::mean)], 20.0F)
      << "a ball of 50 mm";
  EXPECT_EQ(worker.newest("c"), nullptr);
  worker.want("b", nullptr);
  EXPECT_EQ(worker.newest("b"), nullptr);
}

TEST(CurvatureMap, GoesFromHollowOverFlatToBulging) {
  const DivergingRamp& ramp = scene_colours(ColourScheme::normal).curvature;
  const auto near = [](const glm::vec3& a, const glm::vec3& b) { return glm::distance(a, b) < 0.01F; };
  EXPECT_TRUE(near(curvature_colour(ramp, -1.0F), linear_rgb(ramp.negative)));
  EXPECT_TRUE(near(curvature_colour(ramp, 0.0F), linear_rgb(ramp.nought)));
  EXPECT_TRUE(near(curvature_colour(ramp, 1.0F), linear_rgb(ramp.positive)));
  EXPECT_EQ(curvature_colour(ramp, 7.0F), curvature_colour(ramp, 1.0F));
  EXPECT_TRUE(near(curvature_colour(ramp, std::numeric_limits<float>::quiet_NaN()), linear_rgb(ramp.nought)));
  // Ever darker towards both ends.
  float before = 2.0F;
  for (int i = 0; i <= 10; ++i) {
    const glm::vec3 colour = curvature_colour(ramp, 0.1F * static_cast<float>(i));
    const float light = glm::dot(colour, glm::vec3(0.2126F, 0.7152F, 0.0722F));
    EXPECT_LT(light, before);
    before = light;
  }
}

TEST(CurvatureMap, SaysRadiiAsDesignersDo) {
  EXPECT_EQ(radius_words(20.0F), "R 50 mm");
  EXPECT_EQ(radius_words(-20.0F), "−R 50 mm");
  EXPECT_EQ(radius_words(0.5F), "R 2 m");
  EXPECT_EQ(radius_words(0.0F), "flat");
  EXPECT_EQ(radius_words(std::numeric_limits<float>::quiet_NaN()), "flat");
  Overlay overlay;
  add_curvature_legend(CurvatureKind::gaussian, 20.0F, scene_colours(ColourScheme::normal).curvature, 1280,
                       720, overlay);
  ASSERT_EQ(overlay.texts.size(), 6U);
  EXPECT_EQ(overlay.texts[0].text, "Gaussian curvature");
  EXPECT_EQ(overlay.texts[1].text, "+20/m  R 50 mm");
  EXPECT_EQ(overlay.texts[3].text, "+0/m  flat");
  for (const OverlayPanel& panel : overlay.panels) {
    EXPECT_GE(panel.position.x, 0.0F);
    EXPECT_LE(panel.position.x + panel.size.x, 1280.0F);
    EXPECT_LE(panel.position.y + panel.size.y, 720.0F);
  }
}

}  // namespace
}  // namespace handloft::client
