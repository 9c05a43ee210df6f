#include "daemon-tracking/source/hid/report_descriptor.h"

#include <fmt/format.h>

#include <algorithm>

namespace handloft::tracking {
namespace {

// Prefixes of section 6.2.2 without their two bits of length.
constexpr std::uint8_t item_input = 0x80, item_output = 0x90, item_feature = 0xB0, item_collection = 0xA0;
constexpr std::uint8_t item_end_collection = 0xC0, item_usage_page = 0x04, item_report_size = 0x74;
constexpr std::uint8_t item_report_id = 0x84, item_report_count = 0x94, item_push = 0xA4, item_pop = 0xB4;
constexpr std::uint8_t item_usage = 0x08, long_item = 0xFE;
constexpr std::uint8_t application_collection = 1;
constexpr std::size_t max_pushes = 16;
constexpr std::uint32_t max_report_bits = 8u * 65536u;

struct Globals {
  std::uint16_t usage_page = 0;
  std::uint32_t report_size = 0;
  std::uint32_t report_count = 0;
  std::uint8_t report_id = 0;
};

Error corrupt(std::size_t at, const char* what) {
  return make_error(ErrorCode::data_corrupt, fmt::format("at byte {}: {}", at, what), "report_descriptor");
}

Status add_field(const Globals& globals, std::map<std::uint8_t, std::uint32_t>& reports, std::size_t at) {
  const std::uint64_t bits = std::uint64_t{globals.report_size} * globals.report_count;
  std::uint32_t& sum = reports[globals.report_id];
  if (bits + sum > max_report_bits) return corrupt(at, "a report of absurd length");
  sum += static_cast<std::uint32_t>(bits);
  return {};
}

}  // namespace

bool HidReports::is(HidUsage usage) const {
  return std::find(applications.begin(), applications.end(), usage) != applications.end();
}

std::size_t HidReports::bytes(const std::map<std::uint8_t, std::uint32_t>& reports, std::uint8_t id) {
  const auto found = reports.find(id);
  return found == reports.end() ? 0 : (found->second + 7) / 8;
}

Result<HidReports> parse_report_descriptor(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > max_report_descriptor) return corrupt(max_report_descriptor, "longer than any device's");
  HidReports out;
  Globals globals;
  std::vector<Globals> pushed;
  std::uint32_t usage = 0;
  bool usage_extended = false;
  int depth = 0;
  std::size_t at = 0;
  while (at < bytes.size()) {
    const std::uint8_t prefix = bytes[at];
    if (prefix == long_item) {
      if (at + 2 >= bytes.size()) return corrupt(at, "a long item is cut off");
      const std::size_t length = 3u + bytes[at + 1];
      if (length > bytes.size() - at) return corrupt(at, "a long item is cut off");
      at += length;
      continue;
    }
    const std::size_t length = (prefix & 3u) == 3u ? 4u : (prefix & 3u);
    if (length > bytes.size() - at - 1) return corrupt(at, "an item is cut off");
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < length; ++i) value |= std::uint32_t{bytes[at + 1 + i]} << (8 * i);
    Status status;
    bool main_item = true;
    switch (prefix & 0xFCu) {
      case item_input:
        status = add_field(globals, out.input_bits, at);
        break;
      case item_output:
        status = add_field(globals, out.output_bits, at);
        break;
      case item_feature:
        status = add_field(globals, out.feature_bits, at);
        break;
      case item_collection:
        if (depth == 0 && value == application_collection) {
          const std::uint32_t page = usage_extended ? usage >> 16 : globals.usage_page;
          out.applications.push_back(
              {static_cast<std::uint16_t>(page), static_cast<std::uint16_t>(usage & 0xFFFFu)});
        }
        ++depth;
        break;
      case item_end_collection:
        if (--depth < 0) return corrupt(at, "the end of a collection that never began");
        break;
      default:
        main_item = false;
        break;
    }
    if (!status) return status.error();
    switch (prefix & 0xFCu) {
      case item_usage_page:
        globals.usage_page = static_cast<std::uint16_t>(value);
        break;
      case item_report_size:
        globals.report_size = value;
        break;
      case item_report_count:
        globals.report_count = value;
        break;
      case item_report_id:
        if (value == 0 || value > 255) return corrupt(at, "a report id outside 1..255");
        globals.report_id = static_cast<std::uint8_t>(value);
        break;
      case item_push:
        if (pushed.size() >= max_pushes) return corrupt(at, "too many pushes");
        pushed.push_back(globals);
        break;
      case item_pop:
        if (pushed.empty()) return corrupt(at, "a pop without a push");
        globals = pushed.back();
        pushed.pop_back();
        break;
      case item_usage:
        // The first usage names a collection.
        if (usage == 0) {
          usage = value;
          usage_extended = length == 4;
        }
        break;
      default:
        break;
    }
    if (main_item) {
      usage = 0;
      usage_extended = false;
    }
    at += 1 + length;
  }
  if (depth != 0) return corrupt(bytes.size(), "a collection does not end");
  return out;
}

}  // namespace handloft::tracking
