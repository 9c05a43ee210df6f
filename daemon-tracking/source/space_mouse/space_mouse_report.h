#pragma once
// Reports of SpaceNavigator and SpaceMouse devices (3Dconnexion), little-endian, the report's id in front:
//
//   1, 6 bytes    translation x, y, z (i16): the older, split form
//   2, 6 bytes    rotation x, y, z (i16), right after report 1
//   1, 12 bytes   translation and rotation: the newer, combined form
//   3, 1 to 8     buttons, a bit each
//   others        battery, keys by number: nothing for us
//
// The cap's axes are x right, y towards the designer, z down; about +-350 at its ends, though some go to 500.
// Pure, for hostile bytes too.

#include <array>
#include <cstdint>
#include <span>

#include "common/base/result.h"

namespace handloft::tracking {

/// Generic desktop page, multi-axis controller (HID usage tables 1.12, page 26).
inline constexpr std::uint16_t space_mouse_usage_page = 1;
inline constexpr std::uint16_t space_mouse_usage = 8;
inline constexpr std::size_t max_space_mouse_report = 64;

enum class SpaceMousePart : std::uint8_t { translation, rotation, both, buttons, other };

struct SpaceMouseReport {
  SpaceMousePart part = SpaceMousePart::other;
  std::array<std::int16_t, 3> translation{};  ///< Raw, the cap's axes
  std::array<std::int16_t, 3> rotation{};     ///< Raw, about the cap's axes
  std::uint32_t buttons = 0;

  bool operator==(const SpaceMouseReport&) const = default;
};

/// Errors: data_corrupt (no bytes, or a length that its id doesn't have).
Result<SpaceMouseReport> parse_space_mouse_report(std::span<const std::uint8_t> bytes);

/// Whether a USB or Bluetooth device is one of the known 3D mice.
bool is_known_space_mouse(std::uint16_t vendor_id, std::uint16_t product_id);

}  // namespace handloft::tracking
