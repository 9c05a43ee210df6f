#pragma once
// What the ways to tessellate share. Not for others than tessellate*.cpp.

#include <cmath>
#include <cstddef>
#include <utility>

#include "server-model/geometry/tessellate.h"

namespace handloft::geometry::detail {

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

/// Largest second derivative of the heights in any direction at a place: |largest eigenvalue| of the Hessian.
inline double bend_at(const PolynomialSurface& surface, const Vec2& xy) {
  const HeightDerivatives d = surface.derivatives(xy.x(), xy.y());
  return std::abs(d.dxx + d.dyy) / 2 + std::hypot((d.dxx - d.dyy) / 2, d.dxy);
}

/// Checked options and a drawn curve (tessellate_boundary.cpp).
Result<TriangleMesh> tessellate_boundary(const PolynomialSurface& surface, const Frame& frame,
                                         const BoundaryTrim& boundary, const TessellationOptions& options);

/// Checked options and a superellipse (tessellate_rings.cpp).
Result<TriangleMesh> tessellate_rings(const PolynomialSurface& surface, const Frame& frame,
                                      const Superellipse& superellipse, const TessellationOptions& options);

}  // namespace handloft::geometry::detail
