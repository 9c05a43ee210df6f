#pragma once
// The trims of a face of Open CASCADE as loops in its parameters. Not for others than cad_import.

#include <TopoDS_Face.hxx>
#include <cstddef>

#include "common/base/result.h"
#include "server-model/exchange/cad_face.h"

namespace handloft::exchange::detail {

/// `surface` is the face's, as to_geometry() made it. No loops where they are the border of the parameter
/// rectangle. Throws the library's exceptions. Errors: data_corrupt (an edge without a curve in the
/// parameters), resource_exhausted beyond `max_curves`.
Result<TrimLoops> read_loops(const TopoDS_Face& face, const geometry::BSplineSurface& surface,
                             std::size_t max_curves);

}  // namespace handloft::exchange::detail
