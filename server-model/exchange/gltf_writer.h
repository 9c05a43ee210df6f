#pragma once
// Binary glTF 2.0 (.glb): meshes with normals and colour (alpha = opacity), double-sided and blended; point
// clouds as points. Metres; a root node turns our +Z up into glTF's +Y up. Positions are floats relative to
// each object's centre, which its node's translation holds, so that nothing is lost far from the origin.

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/exchange/surface_export.h"

namespace handloft::exchange {

/// The file as bytes; the same input gives the same bytes. Errors: invalid_argument ("meshes[1].normals") for
/// numbers that are not finite, arrays of unequal length, indices out of range or nothing to write.
Result<std::vector<std::byte>> to_glb(std::span<const MeshExport> meshes,
                                      std::span<const PointCloudExport> clouds = {});

/// Writes it whole or not at all; errors also as write_file_atomically().
Status write_glb(const std::filesystem::path& path, std::span<const MeshExport> meshes,
                 std::span<const PointCloudExport> clouds = {});

}  // namespace handloft::exchange
