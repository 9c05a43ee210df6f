#pragma once
// IGES 5.3 through Open CASCADE, for CAD systems that read no STEP (X3): the same true B-spline faces as
// step_writer.h's, as trimmed surfaces (entity 144) with boundaries in space and in the parameter plane,
// millimetres. A face's label holds the first eight characters of its name, which is all that IGES has.

#include <filesystem>
#include <span>
#include <string>

#include "common/base/result.h"
#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/step_writer.h"
#include "server-model/exchange/surface_export.h"

namespace handloft::exchange {

/// As write_step(), with the same options and errors.
Status write_iges(const std::filesystem::path& path, std::span<const SurfaceExport> surfaces,
                  const StepOptions& options = {});
/// Models become their faces, each trimmed by itself: what IGES readers take without fail.
Status write_iges(const std::filesystem::path& path, const CadContent& content,
                  const StepOptions& options = {});
/// What that writes. The header names the file by `file_name`.
Result<std::string> iges_text(const std::string& file_name, const CadContent& content,
                              const StepOptions& options = {});

}  // namespace handloft::exchange
