#pragma once
// What the ways to tessellate a B-spline surface share. Not for others than bspline_tessellate.cpp and
// trimmed_mesh.cpp.

#include <unordered_map>
#include <vector>

#include "server-model/geometry/bspline_tessellate.h"
#include "server-model/geometry/span_bends.h"

namespace handloft::geometry::detail {

/// A box of parameters that needs no finer triangles.
struct SurfaceCell {
  Vec2 lower = Vec2::Zero(), upper = Vec2::Zero();
};

/// Which of the surface's edges are one, or a point.
struct SurfaceJoints {
  explicit SurfaceJoints(const BSplineSurface& surface);
  bool closed_u = false, closed_v = false;          ///< The lower and the upper edge are one.
  bool pole_u_lower = false, pole_u_upper = false;  ///< u = lower is a point.
  bool pole_v_lower = false, pole_v_upper = false;
};

/// Boxes that cover the surface, halved where the chord bound is above the tolerance or a crease passes, and
/// so that closed directions have four at least.
std::vector<SurfaceCell> surface_cells(const BSplineSurface& surface, const SpanBends& bends,
                                       const SurfaceJoints& joints, const SurfaceMeshOptions& options);

/// Vertices of a mesh by their parameters, one where the surface is joined.
class SurfaceVertices {
 public:
  SurfaceVertices(const BSplineSurface& surface, const SurfaceJoints& joints)
      : surface_(surface), joints_(joints) {}
  std::uint32_t at(const Vec2& uv);
  /// The parameters that stand for a place on a seam or a pole.
  Vec2 canonical(Vec2 uv) const;
  /// Leaves out triangles with a vertex twice.
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  const Vec3& place(std::uint32_t vertex) const { return mesh_.positions[vertex]; }
  /// Where each vertex is, by its number.
  std::vector<Vec2> parameters() const;
  TriangleMesh take() && { return std::move(mesh_); }

 private:
  struct Hash {
    std::size_t operator()(const std::pair<double, double>& uv) const {
      return std::hash<double>{}(uv.first) * 0x9e3779b97f4a7c15ULL + std::hash<double>{}(uv.second);
    }
  };
  const BSplineSurface& surface_;
  const SurfaceJoints& joints_;
  std::unordered_map<std::pair<double, double>, std::uint32_t, Hash> index_;
  TriangleMesh mesh_;
};

Status check_options(const SurfaceMeshOptions& options);

}  // namespace handloft::geometry::detail
