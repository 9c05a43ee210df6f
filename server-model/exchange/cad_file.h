#pragma once
// What STEP and IGES files are written by alike. Not for others than step_writer and iges_writer.

#include <TopoDS_Shape.hxx>
#include <filesystem>
#include <functional>
#include <string>

#include "common/base/result.h"
#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/step_writer.h"

namespace handloft::exchange::detail {

/// Gives every surface, face and model as a shape in millimetres to `add`, in this order, with its name and
/// its field ("surfaces[2]", "faces[0]", "models[1]"), below which errors of the shape are named.
Status for_each_shape(const CadContent& content, double contour_tolerance,
                      const std::function<Status(const std::string& name, const TopoDS_Shape& shape,
                                                 const std::string& field)>& add);

/// What `print` writes to a stream, by the classic locale; `print` answers whether it could. Into memory and
/// not by the library's own file access: so a full disk is our error with its reason.
Result<std::string> printed(const std::function<bool(std::ostream&)>& print);

/// Checks content and options, makes the text in an OcctSession, guarded, and writes the file atomically.
Status write_cad_file(const std::filesystem::path& path, const CadContent& content,
                      const StepOptions& options, const char* doing,
                      const std::function<Result<std::string>(const std::string& file_name)>& to_text);

}  // namespace handloft::exchange::detail
