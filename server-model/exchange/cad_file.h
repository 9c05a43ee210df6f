#pragma once
// What STEP and IGES files are written by alike. Not for others than step_writer and iges_writer.

#include <TopoDS_Shape.hxx>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/cad_labels.h"
#include "server-model/exchange/step_writer.h"

namespace handloft::exchange::detail {

/// What is written of a surface, face or model.
struct NamedShape {
  std::string name;
  TopoDS_Shape shape;  ///< In millimetres.
  std::string field;   ///< "surfaces[2]", "faces[0]", "models[1]": below it errors of the shape are named.
  std::vector<LabelledPart> parts;  ///< What a model's file said of its parts.
};

/// Gives every surface, face and model to `add`, in this order.
Status for_each_shape(const CadContent& content, const StepOptions& options,
                      const std::function<Status(const NamedShape& shape)>& add);

/// What `print` writes to a stream, by the classic locale; `print` answers whether it could. Into memory and
/// not by the library's own file access: so a full disk is our error with its reason.
Result<std::string> printed(const std::function<bool(std::ostream&)>& print);

/// Checks content and options and makes the text in an OcctSession, guarded.
Result<std::string> make_cad_text(const CadContent& content, const StepOptions& options, const char* doing,
                                  const std::function<Result<std::string>()>& to_text);

/// Writes what was made, atomically.
Status write_cad_text(const std::filesystem::path& path, const Result<std::string>& text);

}  // namespace handloft::exchange::detail
