#pragma once
// What a closed polygon that may cross itself encloses by the even-odd rule, as faces with simple borders:
// what CAD formats need of a boundary curve (A24, A26). The polygon and its crossings make a plane graph;
// going round its faces, each side of an edge belongs to one, and faces alternate between inside and outside
// across edges.

#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// `outer` goes counterclockwise, holes clockwise; no border crosses itself. A hole may touch the outer
/// border or another hole in single vertices, as where a curl begins.
struct PlanarFace {
  std::vector<Vec2> outer;
  std::vector<std::vector<Vec2>> holes;

  double area() const;
};

struct PlanarFaceOptions {
  /// The polygon is drawn with fewer vertices, none of the left out ones farther than this from it. 10
  /// micrometres is below what machines that make the parts can hold.
  double tolerance_m = 1e-5;
  /// Smaller faces, such as where a stroke's ends overlap by a hair, are left out.
  double least_area_m2 = 1e-9;
  std::size_t max_vertices = 20'000;
  std::size_t max_crossings = 10'000;
};

/// Largest first. Errors: invalid_argument (nothing enclosed, or the curve runs along itself so that its
/// faces can't be told), resource_exhausted.
Result<std::vector<PlanarFace>> planar_faces(std::span<const Vec2> polygon,
                                             const PlanarFaceOptions& options = {});

}  // namespace handloft::geometry
