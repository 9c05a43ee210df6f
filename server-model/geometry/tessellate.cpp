#include "server-model/geometry/tessellate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server-model/geometry/mesh_builder.h"

namespace handloft::geometry {
namespace {

/// Samples per side of the grid on which the curvature is looked for.
constexpr int curvature_samples = 9;

constexpr int largest_divisions = 1024;
constexpr std::size_t most_vertices = 2'000'000;

Status check_options(const TessellationOptions& options) {
  if (!std::isfinite(options.chord_tolerance_m) || options.chord_tolerance_m <= 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected metres above 0", options.chord_tolerance_m),
                      "chord_tolerance_m");
  }
  if (!(options.opacity_tolerance > 0 && options.opacity_tolerance <= 1)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected a number above 0 and up to 1", options.opacity_tolerance),
        "opacity_tolerance");
  }
  if (options.min_divisions < 2 || options.max_divisions < options.min_divisions ||
      options.max_divisions > largest_divisions) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}..{}, expected 2 <= min <= max <= {}", options.min_divisions,
                                  options.max_divisions, largest_divisions),
                      "divisions");
  }
  if (options.max_vertices > most_vertices) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected at most {}", options.max_vertices, most_vertices),
                      "max_vertices");
  }
  return {};
}

/// How many steps `length` needs so that chords of a function of this second derivative stay within half of
/// the tolerance (the other half is for the other direction): the sagitta of a step h is |f''| h^2 / 8.
int divisions_for(double length, double second_derivative, const TessellationOptions& options) {
  const double steps = length * std::sqrt(second_derivative / (4 * options.chord_tolerance_m));
  if (!(steps < options.max_divisions)) return options.max_divisions;  // Also for NaN.
  return std::max(options.min_divisions, static_cast<int>(std::ceil(steps)));
}

double largest_bend(const PolynomialSurface& surface, const Box2& box) {
  double largest = 0;
  for (int i = 0; i < curvature_samples; ++i) {
    for (int j = 0; j < curvature_samples; ++j) {
      const Vec2 unit(2.0 * i / (curvature_samples - 1) - 1, 2.0 * j / (curvature_samples - 1) - 1);
      largest = std::max(largest, detail::bend_at(surface, box.centre + unit.cwiseProduct(box.half_extent)));
    }
  }
  return largest;
}

}  // namespace

Result<TriangleMesh> tessellate(const PolynomialSurface& surface, const Frame& frame, const TrimField& trim,
                                const TessellationOptions& options) {
  if (Status status = check_options(options); !status.ok()) return status.error();
  if (const BoundaryTrim* boundary = trim.boundary()) {
    return detail::tessellate_boundary(surface, frame, *boundary, options);
  }
  return detail::tessellate_rings(surface, frame, *trim.superellipse(), options);
}

Result<TriangleMesh> tessellate_box(const PolynomialSurface& surface, const Frame& frame, const Box2& box,
                                    const TessellationOptions& options) {
  if (Status status = check_options(options); !status.ok()) return status.error();
  if (!box.centre.allFinite() || !box.half_extent.allFinite() || box.half_extent.minCoeff() <= 0) {
    return make_error(ErrorCode::invalid_argument, "found a box without a finite area", "box");
  }
  const double bend = largest_bend(surface, box);
  const auto nx = 2 * static_cast<std::size_t>(divisions_for(box.half_extent.x(), bend, options));
  const auto ny = 2 * static_cast<std::size_t>(divisions_for(box.half_extent.y(), bend, options));
  detail::MeshBuilder builder(surface, frame);
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
