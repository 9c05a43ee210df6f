#include "client-hmd/render/distance_map.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {

glm::vec3 distance_colour(float share, const DistanceColours& colours) {
  if (std::isnan(share)) return colours.nought;
  const float clamped = std::clamp(share, -1.0F, 1.0F);
  return glm::mix(colours.nought, clamped < 0.0F ? colours.negative : colours.positive, std::abs(clamped));
}

glm::vec4 distance_colour_srgb(float share) {
  const glm::vec3 linear = distance_colour(share);
  glm::vec4 encoded(1.0F);
  for (int i = 0; i < 3; ++i) {
    const float c = linear[i];
    encoded[i] = c <= 0.0031308F ? 12.92F * c : 1.055F * std::pow(c, 1.0F / 2.4F) - 0.055F;
  }
  return encoded;
}

}  // namespace handloft::client
