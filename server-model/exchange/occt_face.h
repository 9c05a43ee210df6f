#pragma once
// A surface as a face of Open CASCADE, millimetres. Not for others than cad_file.

#include <TopoDS_Face.hxx>

#include "common/base/result.h"
#include "server-model/exchange/surface_export.h"

namespace handloft::exchange::detail {

/// A face on a true B-spline surface, checked by BRepCheck. `contour_tolerance` as in StepOptions. Throws the
/// library's exceptions. Errors: invalid_argument (a surface that is not finite, or makes no valid face).
Result<TopoDS_Face> make_face(const SurfaceExport& item, double contour_tolerance);

}  // namespace handloft::exchange::detail
