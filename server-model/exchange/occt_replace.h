#pragma once
// Faces of a model exchanged for others of another shape. Not for others than cad_file.

#include <TopoDS_Shape.hxx>
#include <vector>

#include "common/base/result.h"
#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/cad_labels.h"

namespace handloft::exchange::detail {

struct MadeModel {
  TopoDS_Shape shape;
  std::vector<LabelledPart> parts;  ///< Of the shape, those of which the model's file says something.
  std::vector<BorderGap> gaps;
};

/// The model in millimetres, moved by its translation, with changed faces as ModelExport promises. Throws
/// the library's exceptions. Errors: data_corrupt (boundary_representation), invalid_argument
/// (replaced[i].number, .surface; removed[i]; a face that is not valid any more), failed_precondition when no
/// face is left.
Result<MadeModel> make_model(const ModelExport& model);

}  // namespace handloft::exchange::detail
