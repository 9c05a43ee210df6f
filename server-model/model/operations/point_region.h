#pragma once
// Which points of a shape an operation means (PointRegion of operation.proto), and what becomes of the shape
// when some of them move or go: their mirror images with them (A12), the fit stale (A9).

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/model/document.h"

namespace handloft::model {

/// Indices of the points in the region, ascending, each once. The surface of a sphere or box belongs to it.
/// Errors, below `field`: invalid_argument for no region, numbers that are no places, a radius below 0, a
/// minimum above its maximum, a stroke or index that the shape does not have.
Result<std::vector<std::uint32_t>> points_in(const handloft::v1::PointRegion& region, const DualShape& shape,
                                             const std::string& field, const Limits& limits);

}  // namespace handloft::model
