#pragma once
// Triangles of B-spline surfaces and of faces trimmed from them, no farther from the surface than a
// tolerance, fine where it bends and coarse where not, without cracks: seams of closed surfaces and poles are
// joined, and faces that share a boundary have the same vertices there when both are given the same places on
// it.

#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/tessellate.h"
#include "server-model/geometry/trim_region.h"

namespace handloft::geometry {

struct SurfaceMeshOptions {
  /// Largest distance between triangles and surface; a tenth of a millimetre is below what a headset shows.
  double chord_tolerance_m = 1e-4;
  enum class LoopPlaces : std::uint8_t {
    refined,   ///< The loops get more places until they keep to the tolerance too.
    as_given,  ///< Exactly the places of the loops become vertices on them: what neighbours must agree on.
  };
  LoopPlaces loop_places = LoopPlaces::refined;
  /// No box of parameters is wider than this share of the surface: below 1 for flat ones that will be bent.
  double largest_cell = 1;
  std::size_t max_vertices = 200'000;  ///< Refines while it has fewer; at most 4 million.
};

/// The whole surface. Counterclockwise seen from where Su x Sv points; normals are that way too. Opacity 1.
/// Errors: invalid_argument as check(surface) says, and for options out of range.
Result<TriangleMesh> tessellate(const BSplineSurface& surface, const SurfaceMeshOptions& options = {});

/// The part within loops (even-odd rule: an outer loop and its holes). Errors: as above, as
/// TrimRegion::create says, and invalid_argument for loops that cross, failed_precondition for none or no
/// area. With `parameters` not null, the place of each vertex on the surface: for a mesh that will follow it.
Result<TriangleMesh> tessellate(const BSplineSurface& surface, std::vector<TrimLoop> loops,
                                const SurfaceMeshOptions& options = {},
                                std::vector<Vec2>* parameters = nullptr);

/// A loop with places added until its straight parts in (u, v) stay within the tolerance on the surface (A
/// bound decides, so both faces at an edge may come to other places: share one's). At most `max_places`.
Result<TrimLoop> refined_loop(const BSplineSurface& surface, const TrimLoop& loop, double chord_tolerance_m,
                              std::size_t max_places = 100'000);

/// The surface's whole boundary as a loop: its corners.
TrimLoop domain_loop(const BSplineSurface& surface);

}  // namespace handloft::geometry
