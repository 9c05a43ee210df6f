#include "client-hmd/mirror/read_distances.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>

namespace handloft::client {

Result<std::vector<float>> read_distances(std::string_view bytes, std::size_t vertices,
                                          const DistanceLimits& limits) {
  constexpr std::size_t number_bytes = 4;
  if (bytes.size() % number_bytes != 0 || bytes.size() / number_bytes != vertices) {
    return make_error(
        ErrorCode::data_corrupt,
        fmt::format("found {} bytes, expected 4 for each of {} vertices", bytes.size(), vertices),
        "distances");
  }
  std::vector<float> distances;
  distances.reserve(vertices);
  for (std::size_t i = 0; i < vertices; ++i) {
    std::uint32_t bits = 0;
    for (std::size_t k = number_bytes; k-- > 0;) {
      bits = bits << 8U | static_cast<std::uint8_t>(bytes[number_bytes * i + k]);
    }
    const auto distance = std::bit_cast<float>(bits);
    if (!std::isfinite(distance) || std::abs(distance) > limits.max_distance_m) {
      return make_error(
          ErrorCode::data_corrupt,
          fmt::format("found {}, expected a number within {} m", distance, limits.max_distance_m),
          fmt::format("distances[{}]", i));
    }
    distances.push_back(distance);
  }
  return distances;
}

}  // namespace handloft::client
