#pragma once
// Triangles of a surface, for screens and mesh files. Trimmed: out to the last visible opacity of 1/255
// (A23), with an opacity per vertex, finer where the opacity changes and where the surface bends, and without
// cracks. Within a superellipse (A22) rings hug its shape, whose corners and tips no grid would follow;
// within a drawn curve (A24) a grid is halved by newest-vertex bisection (Mitchell 1989), which never leaves
// a vertex on another triangle's side. Untrimmed: a grid over a box, opaque (A26).

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/polynomial_surface.h"
#include "server-model/geometry/trim_field.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// World coordinates; three indices a triangle, counterclockwise seen from the frame's +z.
struct TriangleMesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;    ///< Unit, one a vertex.
  std::vector<double> opacity;  ///< 0..1, one a vertex (eq. 7, eq. 8).
  std::vector<std::uint32_t> indices;

  std::size_t vertex_count() const { return positions.size(); }
  std::size_t triangle_count() const { return indices.size() / 3; }
};

struct TessellationOptions {
  /// Largest distance between triangles and surface; a tenth of a millimetre is below what a headset shows.
  double chord_tolerance_m = 1e-4;
  /// Largest difference between the opacity and what triangles interpolate: a step of 3 % is hard to see.
  double opacity_tolerance = 0.03;
  int min_divisions = 8;  ///< Per quadrant and from centre to rim: enough for the shading.
  int max_divisions =
      48;  ///< Caps a superellipse's mesh at some 4 * 48 * 60 vertices, whatever the curvature.
  std::size_t max_vertices = 16'000;  ///< A drawn curve's mesh refines while it has fewer; at most 2 million.
};

/// The visible part. Where no cap is met, heights are within the chord tolerance and opacities within the
/// opacity tolerance, but in the tips of stars (exponents below 1), which are thinner than any triangle.
/// Errors: invalid_argument for options out of range or a surface that is not finite there.
Result<TriangleMesh> tessellate(const PolynomialSurface& surface, const Frame& frame, const TrimField& trim,
                                const TessellationOptions& options = {});

/// The surface over a box of its base plane, opaque.
Result<TriangleMesh> tessellate_box(const PolynomialSurface& surface, const Frame& frame, const Box2& box,
                                    const TessellationOptions& options = {});

}  // namespace handloft::geometry
