#pragma once
// What a HID report descriptor says of its device (USB HID 1.11, section 6.2.2), as far as is needed to know
// a device before anything is sent to it: what it is, and which reports of which length it has. Hostile
// input: bounded, pure, fuzzed.

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace handloft::tracking {

inline constexpr std::size_t max_report_descriptor = 4096;  ///< HID_MAX_DESCRIPTOR_SIZE of Linux.

struct HidUsage {
  std::uint16_t page = 0;
  std::uint16_t usage = 0;
  bool operator==(const HidUsage&) const = default;
};

struct HidReports {
  std::vector<HidUsage> applications;  ///< Of the top collections, in order.
  /// Bits by report id; id 0 when the device numbers none.
  std::map<std::uint8_t, std::uint32_t> input_bits, output_bits, feature_bits;

  bool is(HidUsage usage) const;
  /// Bytes on the wire without the id; 0: no such report.
  static std::size_t bytes(const std::map<std::uint8_t, std::uint32_t>& reports, std::uint8_t id);
};

/// Errors: data_corrupt (an item is cut off, collections don't match, absurd sizes).
Result<HidReports> parse_report_descriptor(std::span<const std::uint8_t> bytes);

}  // namespace handloft::tracking
