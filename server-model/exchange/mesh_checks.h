#pragma once
// Checks that every mesh exporter makes before the first byte. Not for others.

#include <span>

#include "common/base/result.h"
#include "server-model/exchange/surface_export.h"

namespace handloft::exchange::detail {

/// Errors: invalid_argument with the field ("meshes[1].normals", "clouds[0].points[7]").
Status check_meshes(std::span<const MeshExport> meshes);
Status check_clouds(std::span<const PointCloudExport> clouds);

}  // namespace handloft::exchange::detail
