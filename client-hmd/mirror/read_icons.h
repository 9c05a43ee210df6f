#pragma once
// Icons of a sculpted surface from the wire (scene.proto, D17), checked: known kinds, numbers that are finite
// and in the room, texts and outlines of bounded length.

#include <vector>

#include "client-hmd/mirror/scene.h"
#include "common/base/result.h"
#include "proto/scene.pb.h"

namespace handloft::client {

struct IconLimits {
  std::size_t max_icons = 4096;                ///< Of one entity; a surface has tens.
  std::size_t max_outline_points = 1'000'000;  ///< Of all of them together.
  std::size_t max_text_bytes = 256;
  std::size_t max_label_bytes = 16;  ///< "RV" is the longest that there is.
  double max_coordinate_m = 1e4;     ///< As CurveLimits.
};

/// Errors: data_corrupt or resource_exhausted, naming the field.
Result<std::vector<SceneIcon>> read_icons(const google::protobuf::RepeatedPtrField<v1::Icon>& icons,
                                          const IconLimits& limits);

}  // namespace handloft::client
