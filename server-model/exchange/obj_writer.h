#pragma once
// Wavefront OBJ text: one object a mesh, positions and normals in metres, +Z up as in our world, numbers in
// their shortest exact form whatever the locale.

#include <filesystem>
#include <span>
#include <string>

#include "common/base/result.h"
#include "server-model/exchange/surface_export.h"

namespace handloft::exchange {

/// Errors: invalid_argument as to_glb().
Result<std::string> to_obj(std::span<const MeshExport> meshes);
Status write_obj(const std::filesystem::path& path, std::span<const MeshExport> meshes);

}  // namespace handloft::exchange
