#pragma once
// What STEP and IGES files are written by alike. Not for others than step_writer and iges_writer.

#include <TopoDS_Face.hxx>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "server-model/exchange/step_writer.h"
#include "server-model/exchange/surface_export.h"

namespace handloft::exchange::detail {

/// Gives every surface's face to `add`, in order, with the surface's field ("surfaces[2]"), below which
/// errors of the face are named.
Status for_each_face(
    std::span<const SurfaceExport> surfaces, double contour_tolerance,
    const std::function<Status(const SurfaceExport&, const TopoDS_Face&, const std::string& field)>& add);

/// What `print` writes to a stream, by the classic locale; `print` answers whether it could. Into memory and
/// not by the library's own file access: so a full disk is our error with its reason.
Result<std::string> printed(const std::function<bool(std::ostream&)>& print);

/// Checks surfaces and options, makes the text in an OcctSession, guarded, and writes the file atomically.
Status write_cad_file(const std::filesystem::path& path, std::span<const SurfaceExport> surfaces,
                      const StepOptions& options, const char* doing,
                      const std::function<Result<std::string>(const std::string& file_name)>& to_text);

}  // namespace handloft::exchange::detail
