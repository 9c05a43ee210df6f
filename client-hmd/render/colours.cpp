#include "client-hmd/render/colours.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {
namespace {

constexpr SceneColours normal_colours{
    // The default rig's caps.
    .fingers = {0xDC2833, 0x28BD3B, 0x2846DC, 0xE6D11E, 0xD232C8},
    // Okabe and Ito as they are.
    .users = {0x0072B2, 0xE69F00, 0x009E73, 0xCC79A7, 0x56B4E9, 0xD55E00, 0xF0E442},
    .pressing = 0xE8662A,
    .resting = 0x5B738F,
    .profile = 0xE86020,
    .boundary = 0x0E7C86,
    .curve = 0x263449,
    .selected = 0x1F6FEB,
    .target = 0xE0821E,
    .symmetry = 0x3D6FB6,
    .control_net = 0x1B4F8F,
    .control_point = 0xE0821E,
    .good = 0x1F8A55,
    .caution = 0xC77700,
    .bad = 0xB3202A,
    .distance = {0x2466B2, 0xDDDDDD, 0xE67C16},
    .curvature = {0x2166AC, 0xF2F2F2, 0xB2182B},
};

constexpr SceneColours safe_colours{
    .fingers = {0x9E4500, 0xDBEE0D, 0x5AAE8F, 0x165276, 0xDD70ED},
    .users = {0x168CFF, 0xB39A30, 0x2B7962, 0xF35793, 0x8DE4FF, 0xA84100, 0xEBE505},
    .pressing = 0xD55E00,
    .resting = 0x3A5F8A,
    .profile = 0xE86A10,
    .boundary = 0x0A6A9E,
    .curve = 0x1C2430,
    .selected = 0x0072B2,
    .target = 0xE69F00,
    .symmetry = 0x0072B2,
    .control_net = 0x123F78,
    .control_point = 0xE69F00,
    .good = 0x00857A,
    .caution = 0xE69F00,
    .bad = 0x8E1B10,
    .distance = {0x2466B2, 0xDDDDDD, 0xE67C16},
    .curvature = {0x5E3C99, 0xF2F2F2, 0xE66101},
};

constexpr SceneColours contrast_colours{
    .fingers = {0x7A2A00, 0xE8F000, 0x4FBF9A, 0x0A3F66, 0xE070F0},
    .users = {0x0C8BF0, 0x7C7C00, 0x3D5A5B, 0xF08699, 0xBCFFFF, 0x562800, 0xDBE316},
    .pressing = 0xFF7A00,
    .resting = 0x0A2A66,
    .profile = 0xFF7A00,
    .boundary = 0x00508A,
    .curve = 0x000000,
    .selected = 0x003C8A,
    .target = 0xFFB000,
    .symmetry = 0x003C8A,
    .control_net = 0x00205A,
    .control_point = 0xFFB000,
    .good = 0x00614F,
    .caution = 0xF0A800,
    .bad = 0x7A0000,
    .distance = {0x10107A, 0xFFFFFF, 0xFF7A00},
    .curvature = {0x3B0A7A, 0xFFFFFF, 0xF07000},
};

// IEC 61966-2-1, for one channel of 0x00RRGGBB.
float channel(std::uint32_t colour, unsigned shift) {
  return static_cast<float>(colour >> shift & 0xFFU) / 255.0F;
}

float decode(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

}  // namespace

std::string_view colour_scheme_name(ColourScheme scheme) {
  switch (scheme) {
    case ColourScheme::normal:
      return "normal";
    case ColourScheme::colour_blind_safe:
      return "colour-blind-safe";
    case ColourScheme::high_contrast:
      return "high-contrast";
  }
  return "normal";
}

std::optional<ColourScheme> colour_scheme_from(std::string_view name) {
  for (const ColourScheme scheme : colour_schemes) {
    if (colour_scheme_name(scheme) == name) return scheme;
  }
  return std::nullopt;
}

const SceneColours& scene_colours(ColourScheme scheme) {
  switch (scheme) {
    case ColourScheme::colour_blind_safe:
      return safe_colours;
    case ColourScheme::high_contrast:
      return contrast_colours;
    case ColourScheme::normal:
      break;
  }
  return normal_colours;
}

std::uint32_t user_colour(std::uint64_t client_id, ColourScheme scheme) {
  const auto& users = scene_colours(scheme).users;
  return users[client_id % users.size()];
}

glm::vec3 linear_rgb(std::uint32_t srgb) {
  return {decode(channel(srgb, 16)), decode(channel(srgb, 8)), decode(channel(srgb, 0))};
}

glm::vec4 overlay_rgba(std::uint32_t srgb, float opacity) {
  return {channel(srgb, 16), channel(srgb, 8), channel(srgb, 0), opacity};
}

glm::vec3 ramp_colour(const DivergingRamp& ramp, float share) {
  const float at = std::isnan(share) ? 0.0F : std::clamp(share, -1.0F, 1.0F);
  const glm::vec3 end = linear_rgb(at < 0.0F ? ramp.negative : ramp.positive);
  return glm::mix(linear_rgb(ramp.nought), end, std::abs(at));
}

}  // namespace handloft::client
