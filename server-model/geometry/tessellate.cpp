#include "server-model/geometry/tessellate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace handloft::geometry {
namespace {

/// The opacity falls from f = 0.9 on (T = 0.95) to the rim; steps of 0.12 draw eq. 7 within 0.03 when the
/// triangles interpolate it linearly.
constexpr double fade_begin = 0.9;
constexpr double fade_step = 0.12;

/// Samples per side of the grid on which the curvature is looked for.
constexpr int curvature_samples = 9;

constexpr int largest_divisions = 1024;

Status check_options(const TessellationOptions& options) {
  if (!std::isfinite(options.chord_tolerance_m) || options.chord_tolerance_m <= 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected metres above 0", options.chord_tolerance_m),
                      "chord_tolerance_m");
  }
  if (options.min_divisions < 2 || options.max_divisions < options.min_divisions ||
      options.max_divisions > largest_divisions) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}..{}, expected 2 <= min <= max <= {}", options.min_divisions,
                                  options.max_divisions, largest_divisions),
                      "divisions");
  }
  return {};
}

/// How many steps `length` needs so that chords of a function of this second derivative stay within
/// tolerance: the sagitta of a step h is |f''| h^2 / 8.
int divisions_for(double length, double second_derivative, const TessellationOptions& options) {
  const double steps = length * std::sqrt(second_derivative / (4 * options.chord_tolerance_m));
  if (!(steps < options.max_divisions)) return options.max_divisions;  // Also for NaN.
  return std::max(options.min_divisions, static_cast<int>(std::ceil(steps)));
}

/// Largest second derivative of the heights in any direction, over the box.
double largest_second_derivative(const PolynomialSurface& surface, const Box2& box) {
  double largest = 0;
  for (int i = 0; i < curvature_samples; ++i) {
    for (int j = 0; j < curvature_samples; ++j) {
      const Vec2 unit(2.0 * i / (curvature_samples - 1) - 1, 2.0 * j / (curvature_samples - 1) - 1);
      const Vec2 xy = box.centre + unit.cwiseProduct(box.half_extent);
      const HeightDerivatives d = surface.derivatives(xy.x(), xy.y());
      // Largest absolute eigenvalue of the Hessian.
      const double mean = (d.dxx + d.dyy) / 2;
      const double spread = std::hypot((d.dxx - d.dyy) / 2, d.dxy);
      largest = std::max(largest, std::abs(mean) + spread);
    }
  }
  return largest;
}

class MeshBuilder {
 public:
  MeshBuilder(const PolynomialSurface& surface, const Frame& frame) : surface_(surface), frame_(frame) {}

  void reserve(std::size_t vertices, std::size_t triangles) {
    mesh_.positions.reserve(vertices);
    mesh_.normals.reserve(vertices);
    mesh_.opacity.reserve(vertices);
    mesh_.indices.reserve(3 * triangles);
  }
  void vertex(const Vec2& xy, double opacity) {
    mesh_.positions.push_back(surface_.world_point(frame_, xy.x(), xy.y()));
    mesh_.normals.push_back(surface_.world_normal(frame_, xy.x(), xy.y()));
    mesh_.opacity.push_back(opacity);
  }
  void triangle(std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t index : {a, b, c}) mesh_.indices.push_back(static_cast<std::uint32_t>(index));
  }
  Result<TriangleMesh> finish() && {
    for (std::size_t i = 0; i < mesh_.positions.size(); ++i) {
      if (!mesh_.positions[i].allFinite() || !mesh_.normals[i].allFinite()) {
        return make_error(ErrorCode::invalid_argument, "the surface is not finite over its visible part",
                          "surface");
      }
    }
    return std::move(mesh_);
  }

 private:
  const PolynomialSurface& surface_;
  const Frame& frame_;
  TriangleMesh mesh_;
};

/// Fractions 0 < s <= 1 of the way from the centre to the rim: even steps, and finer where the opacity fades.
std::vector<double> ring_fractions(const Superellipse& superellipse, int divisions) {
  const double rim = visible_level();
  const double n = superellipse.exponent();
  const double even_step = 1.0 / divisions;
  std::vector<double> rings;
  double s = 0;
  while (s < 1) {
    const double limit = std::max(rim * std::pow(s, n), fade_begin) + fade_step;
    double next = std::min(s + even_step, std::pow(std::min(limit / rim, 1.0), 1 / n));
    if (next > 1 - 0.1 * (next - s)) next = 1;  // No sliver at the rim.
    rings.push_back(next);
    s = next;
  }
  return rings;
}

}  // namespace

Result<TriangleMesh> tessellate(const PolynomialSurface& surface, const Frame& frame,
                                const Superellipse& superellipse, const TessellationOptions& options) {
  if (Status status = check_options(options); !status.ok()) return status.error();
  const Box2 visible{superellipse.centre(), superellipse.contour_half_extent(visible_level())};
  const double bend = largest_second_derivative(surface, visible);
  const double reach = visible.half_extent.maxCoeff();
  const int outwards = divisions_for(reach, bend, options);
  // A quarter of the rim is about a quarter of a circle's.
  const int around_quarter = divisions_for(reach * std::numbers::pi / 2, bend, options);
  const std::vector<Vec2> rim = superellipse.contour(visible_level(), around_quarter);
  const std::vector<double> rings = ring_fractions(superellipse, outwards);
  const std::size_t around = rim.size();

  MeshBuilder builder(surface, frame);
  builder.reserve(1 + rings.size() * around, around * (2 * rings.size() - 1));
  builder.vertex(superellipse.centre(), 1.0);
  for (const double s : rings) {
    const double opacity = opacity_at_level(visible_level() * std::pow(s, superellipse.exponent()));
    for (const Vec2& p : rim)
      builder.vertex(superellipse.centre() + s * (p - superellipse.centre()), opacity);
  }
  for (std::size_t k = 0; k < around; ++k) builder.triangle(0, 1 + k, 1 + (k + 1) % around);
  for (std::size_t ring = 1; ring < rings.size(); ++ring) {
    const std::size_t inner = 1 + (ring - 1) * around;
    const std::size_t outer = inner + around;
    for (std::size_t k = 0; k < around; ++k) {
      const std::size_t next = (k + 1) % around;
      builder.triangle(inner + k, outer + k, outer + next);
      builder.triangle(inner + k, outer + next, inner + next);
    }
  }
  return std::move(builder).finish();
}

Result<TriangleMesh> tessellate_box(const PolynomialSurface& surface, const Frame& frame, const Box2& box,
                                    const TessellationOptions& options) {
  if (Status status = check_options(options); !status.ok()) return status.error();
  if (!box.centre.allFinite() || !box.half_extent.allFinite() || box.half_extent.minCoeff() <= 0) {
    return make_error(ErrorCode::invalid_argument, "found a box without a finite area", "box");
  }
  const double bend = largest_second_derivative(surface, box);
  const auto nx = static_cast<std::size_t>(2 * divisions_for(box.half_extent.x(), bend, options));
  const auto ny = static_cast<std::size_t>(2 * divisions_for(box.half_extent.y(), bend, options));
  MeshBuilder builder(surface, frame);
  builder.reserve((nx + 1) * (ny + 1), 2 * nx * ny);
  for (std::size_t i = 0; i <= nx; ++i) {
    for (std::size_t j = 0; j <= ny; ++j) {
      const Vec2 unit(2.0 * static_cast<double>(i) / static_cast<double>(nx) - 1,
                      2.0 * static_cast<double>(j) / static_cast<double>(ny) - 1);
      builder.vertex(box.centre + unit.cwiseProduct(box.half_extent), 1.0);
    }
  }
  for (std::size_t i = 0; i < nx; ++i) {
    for (std::size_t j = 0; j < ny; ++j) {
      const std::size_t a = i * (ny + 1) + j;
      const std::size_t b = a + ny + 1;
      builder.triangle(a, b, b + 1);
      builder.triangle(a, b + 1, a + 1);
    }
  }
  return std::move(builder).finish();
}

}  // namespace handloft::geometry
