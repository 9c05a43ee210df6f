#pragma once
// What sculpt_rows.cpp and sculpt_loads.cpp share. Not for others.

#include <utility>
#include <vector>

#include "server-model/geometry/bspline_surface.h"

namespace handloft::geometry {

/// surface_functional() of a finite place.
Result<SurfaceFunctional> functional_at(const BSplineSurface& rest, const Vec2& uv, int a, int b);

/// Sorted by point, each once, values added in the order given.
SurfaceFunctional merged(std::vector<std::pair<std::uint32_t, double>> terms);

}  // namespace handloft::geometry
