#include "daemon-tracking/source/space_mouse/space_mouse_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace handloft::tracking {
namespace {

constexpr std::uint8_t translation_id = 1, rotation_id = 2, buttons_id = 3;
constexpr std::size_t split_size = 1 + 3 * 2, combined_size = 1 + 6 * 2, largest_buttons_size = 1 + 8;

constexpr std::uint16_t logitech = 0x046D, connexion = 0x256F;
constexpr std::pair<std::uint16_t, std::uint16_t> known[] = {
    {logitech, 0xC603},   // SpaceMouse Plus USB
    {logitech, 0xC605},   // CADman
    {logitech, 0xC606},   // SpaceMouse Classic USB
    {logitech, 0xC621},   // Spaceball 5000 USB
    {logitech, 0xC623},   // SpaceTraveler
    {logitech, 0xC625},   // SpacePilot
    {logitech, 0xC626},   // SpaceNavigator
    {logitech, 0xC627},   // SpaceExplorer
    {logitech, 0xC628},   // SpaceNavigator for Notebooks
    {logitech, 0xC629},   // SpacePilot Pro
    {logitech, 0xC62B},   // SpaceMouse Pro
    {connexion, 0xC62E},  // SpaceMouse Wireless, by cable
    {connexion, 0xC62F},  // SpaceMouse Wireless, its receiver
    {connexion, 0xC631},  // SpaceMouse Pro Wireless, by cable
    {connexion, 0xC632},  // SpaceMouse Pro Wireless, its receiver
    {connexion, 0xC633},  // SpaceMouse Enterprise
    {connexion, 0xC635},  // SpaceMouse Compact
    {connexion, 0xC636},  // SpaceMouse Module
    {connexion, 0xC638},  // SpaceMouse Pro Wireless, Bluetooth
    {connexion, 0xC63A},  // SpaceMouse Wireless, Bluetooth
    {connexion, 0xC652},  // Universal Receiver
};

void read_axes(std::span<const std::uint8_t> bytes, std::array<std::int16_t, 3>& to) {
  for (std::size_t i = 0; i < to.size(); ++i)
    to[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8));
}

}  // namespace

Result<SpaceMouseReport> parse_space_mouse_report(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return make_error(ErrorCode::data_corrupt, "found no bytes", "report");
  const auto wrong_length = [&] {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} bytes in report {}, which it never has", bytes.size(), bytes[0]),
                      "length");
  };
  SpaceMouseReport out;
  switch (bytes[0]) {
    case translation_id:
      if (bytes.size() != split_size && bytes.size() != combined_size) return wrong_length();
      out.part = bytes.size() == combined_size ? SpaceMousePart::both : SpaceMousePart::translation;
      read_axes(bytes.subspan(1, 6), out.translation);
      if (out.part == SpaceMousePart::both) read_axes(bytes.subspan(7, 6), out.rotation);
      return out;
    case rotation_id:
      if (bytes.size() != split_size) return wrong_length();
      out.part = SpaceMousePart::rotation;
      read_axes(bytes.subspan(1, 6), out.rotation);
      return out;
    case buttons_id:
      if (bytes.size() < 2 || bytes.size() > largest_buttons_size) return wrong_length();
      out.part = SpaceMousePart::buttons;
      for (std::size_t i = 1; i < bytes.size() && i <= 4; ++i)
        out.buttons |= std::uint32_t{bytes[i]} << (8 * (i - 1));
      return out;
    default:
      if (bytes.size() > max_space_mouse_report) return wrong_length();
      return out;
  }
}

bool is_known_space_mouse(std::uint16_t vendor_id, std::uint16_t product_id) {
  return std::find(std::begin(known), std::end(known), std::pair(vendor_id, product_id)) != std::end(known);
}

}  // namespace handloft::tracking
