#pragma once
// The part of a mesh that is at least half opaque, cut along the contour: for formats that know no opacity,
// in which the faint rim of a visible mesh (A23, A24) would stand as solid as the rest (A26).

#include "server-model/geometry/tessellate.h"

namespace handloft::exchange {

/// Triangles across the contour are cut where the opacity, linear along their edges, is `opacity`; what is
/// left keeps orientation, normals and shared vertices, and no vertex is left over. An opacity that is not
/// a number counts as 0. Precondition: indices below the number of vertices, in threes.
geometry::TriangleMesh cut_at_opacity(const geometry::TriangleMesh& mesh, double opacity);

}  // namespace handloft::exchange
