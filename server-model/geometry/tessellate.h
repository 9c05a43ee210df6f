#pragma once
// Triangles of a surface, for screens and mesh files. Trimmed: rings that hug the superellipse out to the
// last visible level f = 1.953 (A23), with an opacity per vertex. Untrimmed: a grid over a box, opaque (A26).

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/superellipse.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// World coordinates; three indices a triangle, counterclockwise seen from the frame's +z.
struct TriangleMesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;    ///< Unit, one a vertex.
  std::vector<double> opacity;  ///< 0..1, one a vertex (eq. 7).
  std::vector<std::uint32_t> indices;

  std::size_t vertex_count() const { return positions.size(); }
  std::size_t triangle_count() const { return indices.size() / 3; }
};

struct TessellationOptions {
  /// Largest distance between triangles and surface; a tenth of a millimetre is below what a headset shows.
  double chord_tolerance_m = 1e-4;
  int min_divisions = 8;   ///< Per quadrant and from centre to rim: enough for the shading and the contour.
  int max_divisions = 48;  ///< Caps a mesh at some 4 * 48 * 60 vertices, whatever the curvature.
};

/// The visible part: f <= visible_level(). Errors: invalid_argument for options out of range or a surface
/// that is not finite there.
Result<TriangleMesh> tessellate(const PolynomialSurface& surface, const Frame& frame,
                                const Superellipse& superellipse, const TessellationOptions& options = {});

/// The surface over a box of its base plane, opaque.
Result<TriangleMesh> tessellate_box(const PolynomialSurface& surface, const Frame& frame, const Box2& box,
                                    const TessellationOptions& options = {});

}  // namespace handloft::geometry
