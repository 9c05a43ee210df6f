#pragma once
// A face within straight-sided borders of the parameter plane, as a drawn curve makes them (A24, A26). Along
// a straight line a polynomial surface is a polynomial of its degree, so the edges lie exactly on it. Not for
// others than occt_face.

#include <Geom_BSplineSurface.hxx>
#include <TopoDS_Face.hxx>

#include "common/base/result.h"
#include "server-model/exchange/surface_export.h"

namespace handloft::exchange::detail {

/// The box around a region's outer border.
geometry::Box2 region_box(const geometry::PlanarFace& region);

/// `surface` has millimetres from the box's lower corner as its parameters. Throws the library's exceptions.
Result<TopoDS_Face> region_face(const SurfaceExport& item, const Handle(Geom_BSplineSurface) & surface,
                                const geometry::Box2& box);

}  // namespace handloft::exchange::detail
