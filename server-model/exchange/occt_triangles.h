#pragma once
// Triangles that Open CASCADE laid on a face. Not for others than cad_import and reference_cad.

#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>

#include "common/base/result.h"
#include "server-model/exchange/raw_triangles.h"

namespace handloft::exchange::detail {

constexpr double angular_tolerance_rad = 0.5;  ///< The library's own default: round things look round.

/// How far triangles may lie from the shape, its units (millimetres): the options' tolerance, or their part
/// of its diagonal. Errors: data_corrupt for a shape without bounds.
Result<double> chord_of(const TopoDS_Shape& shape, double chord_tolerance_m, double chord_fraction);

/// Appends them in metres; none when the face has none. Errors: resource_exhausted.
Status append_triangles(const TopoDS_Face& face, RawTriangles& into, const ReferenceOptions& options);

}  // namespace handloft::exchange::detail
