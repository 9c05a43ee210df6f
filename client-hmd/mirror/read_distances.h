#pragma once
// How far every vertex of a shape's surface is from the nearest reference (A28; `distances` in scene.proto),
// checked: packed floats, as many as the surface that they came with has vertices.

#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace handloft::client {

struct DistanceLimits {
  /// Between two places that are within 10 km of the table's centre (common/codec) on each axis, rounded up.
  double max_distance_m = 4e4;
};

/// `bytes`: little-endian float32, signed metres. Errors: data_corrupt naming `distances` for another length
/// than 4 * `vertices`, for a number that is not finite, or that is out of reach.
Result<std::vector<float>> read_distances(std::string_view bytes, std::size_t vertices,
                                          const DistanceLimits& limits = {});

}  // namespace handloft::client
