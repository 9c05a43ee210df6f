#pragma once
// A polyline of the wire (scene.proto), checked: packed floats that are finite and in the room.

#include "client-hmd/mirror/scene.h"
#include "common/base/result.h"
#include "proto/scene.pb.h"

namespace handloft::client {

struct CurveLimits {
  std::size_t max_points = 1'000'000;
  double max_coordinate_m = 1e4;  ///< As in common/codec: nothing on a table is 10 km away.
};

/// Errors: data_corrupt (a broken point, NaN, an unknown kind) or resource_exhausted, naming the field.
Result<SceneCurve> read_curve(const v1::Polyline& line, const CurveLimits& limits);

}  // namespace handloft::client
