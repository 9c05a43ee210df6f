#pragma once
// What the parts of SurfaceProjector share. Not for others than bspline_projection.cpp, bspline_closest.cpp
// and bspline_ray.cpp.

#include <optional>

#include "server-model/geometry/bspline_pieces.h"
#include "server-model/geometry/bspline_projection.h"

namespace handloft::geometry::detail {

enum class PieceKind : std::uint8_t {
  outside,  ///< Of the loops: not in the tree.
  whole,
  crossed,  ///< By a loop.
};

/// A stretch of a loop within a piece, in the piece's own parameters. On the surface it is a Bezier curve of
/// degree p + q.
struct TrimEdge {
  std::uint32_t piece = 0;
  Vec2 from = Vec2::Zero(), to = Vec2::Zero();
};

struct ProjectorData {
  ProjectorData(const BSplineSurface& surface, TrimRegion region, const ProjectorOptions& chosen);

  /// Boxes, edges and size, for pieces marked in `touched`; for all when it is empty.
  void refit(std::span<const std::uint8_t> touched);
  /// Whether a place of a piece belongs to the region.
  bool accepts(std::size_t piece, double s, double t) const {
    return kinds[piece] == PieceKind::whole || trim.inside(pieces.parameters(piece, s, t));
  }
  /// Whether a rectangle of a piece lies outside of the region, for certain.
  bool outside(std::size_t piece, const Vec2& low, const Vec2& high) const;
  const double* edge_curve(std::size_t edge) const {
    return edge_curves.data() + edge * edge_component() * (pieces.is_rational() ? 4 : 3);
  }
  std::size_t edge_component() const {
    return static_cast<std::size_t>(pieces.degree_u()) + static_cast<std::size_t>(pieces.degree_v()) + 1;
  }

  ProjectorOptions options;
  BezierPieces pieces;
  TrimRegion trim;
  std::vector<Vec3> control;
  std::vector<PieceKind> kinds;
  BoxTree tree;
  std::vector<TrimEdge> edges;
  std::vector<std::vector<std::uint32_t>> edges_of;  ///< By piece; empty without loops.
  std::vector<double> edge_curves;
  std::vector<Box3> edge_boxes;
  BoxTree edge_tree;
  Vec3 centre = Vec3::Zero();
  double size = 0;  ///< The diagonal of all.
};

ClosestOnSurface find_closest(const ProjectorData& data, const Vec3& place, const Vec2* seed);
std::optional<SurfaceHit> find_hit(const ProjectorData& data, const Vec3& origin, const Vec3& unit_direction);

}  // namespace handloft::geometry::detail
