#pragma once
// Faces of a model exchanged for others of another shape. Not for others than cad_file.

#include <TopoDS_Shape.hxx>

#include "common/base/result.h"
#include "server-model/exchange/cad_export.h"

namespace handloft::exchange::detail {

/// The model in millimetres, moved by its translation, with changed faces as ModelExport promises. Throws
/// the library's exceptions. Errors: data_corrupt (boundary_representation), invalid_argument
/// (replaced[i].number, .surface; removed[i]; a face that is not valid any more), failed_precondition when no
/// face is left.
Result<TopoDS_Shape> make_model(const ModelExport& model);

}  // namespace handloft::exchange::detail
