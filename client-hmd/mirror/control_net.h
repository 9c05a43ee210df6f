#pragma once
// The net of control points behind a B-spline surface, to be drawn over it (V3).

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client-hmd/mirror/scene.h"

namespace handloft::client {

struct ControlNet {
  std::uint32_t rows = 0;     ///< Along u; at least 2.
  std::uint32_t columns = 0;  ///< Along v; at least 2.
  std::vector<Vec3f> points;  ///< rows * columns, row by row; world, metres.
};

/// By the entity's id; never null.
using ControlNets = std::map<std::string, std::shared_ptr<const ControlNet>>;

}  // namespace handloft::client
