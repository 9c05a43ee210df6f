#include "client-hmd/shots/matte.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace handloft::client {
namespace {

// IEC 61966-2-1.
float decode(std::uint8_t byte) {
  const float c = static_cast<float>(byte) / 255.0F;
  return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
}
std::uint8_t encode(float linear) {
  const float c = std::clamp(linear, 0.0F, 1.0F);
  const float encoded = c <= 0.0031308F ? 12.92F * c : 1.055F * std::pow(c, 1.0F / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(std::lround(255.0F * encoded));
}

}  // namespace

Result<Image> difference_matte(const Image& before_black, const Image& before_grey) {
  if (before_black.width_px != before_grey.width_px || before_black.height_px != before_grey.height_px ||
      before_black.rgba.size() != before_grey.rgba.size()) {
    return make_error(ErrorCode::invalid_argument, "two pictures of different sizes make no matte");
  }
  std::array<float, 256> linear{};
  for (std::size_t i = 0; i < linear.size(); ++i) linear[i] = decode(static_cast<std::uint8_t>(i));
  Image out = before_black;
  for (std::size_t i = 0; i + 3 < out.rgba.size(); i += 4) {
    float through = 0.0F;
    for (std::size_t k = 0; k < 3; ++k) {
      through += linear[before_grey.rgba[i + k]] - linear[before_black.rgba[i + k]];
    }
    const float opacity = std::clamp(1.0F - through / (3.0F * matte_grey), 0.0F, 1.0F);
    const auto alpha = static_cast<std::uint8_t>(std::lround(255.0F * opacity));
    for (std::size_t k = 0; k < 3; ++k) {
      out.rgba[i + k] = alpha == 0     ? 0
                        : alpha == 255 ? before_black.rgba[i + k]
                                       : encode(linear[before_black.rgba[i + k]] / opacity);
    }
    out.rgba[i + 3] = alpha;
  }
  return out;
}

}  // namespace handloft::client
