#include "daemon-tracking/source/glove_report.h"

#include <fmt/format.h>

namespace handloft::tracking {
namespace {

// Offsets of the layout in glove_report.h.
constexpr std::size_t at_id = 0, at_version = 1, at_flags = 2, at_sequence = 4, at_time = 6, at_force = 10;
constexpr std::size_t at_potentiometer = 12, at_contacts = 14, at_battery = 16, at_reserved = 17,
                      at_checksum = 60;

constexpr std::array<std::uint32_t, 256> crc_table = [] {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit) value = (value & 1u) ? (value >> 1) ^ 0xEDB88320u : value >> 1;
    table[i] = value;
  }
  return table;
}();

std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const std::uint8_t byte : bytes) crc = (crc >> 8) ^ crc_table[(crc ^ byte) & 0xFFu];
  return ~crc;
}

std::uint16_t read_u16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | (bytes[at + 1] << 8));
}

std::uint32_t read_u32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(read_u16(bytes, at)) |
         (static_cast<std::uint32_t>(read_u16(bytes, at + 2)) << 16);
}

template <typename Bytes>
void write_u16(Bytes& bytes, std::size_t at, std::uint16_t value) {
  bytes[at] = static_cast<std::uint8_t>(value & 0xFFu);
  bytes[at + 1] = static_cast<std::uint8_t>(value >> 8);
}

template <typename Bytes>
void write_u32(Bytes& bytes, std::size_t at, std::uint32_t value) {
  write_u16(bytes, at, static_cast<std::uint16_t>(value & 0xFFFFu));
  write_u16(bytes, at + 2, static_cast<std::uint16_t>(value >> 16));
}

Error out_of_range(const char* field, unsigned found, unsigned limit) {
  return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0..{}", found, limit),
                    field);
}

Error unknown_bits(const char* field, unsigned found, unsigned known) {
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found bits {:#06x}, known are {:#06x}", found, known), field);
}

// USB HID 1.11 section 6.2.2: short items, the low two bits of each prefix are the length of its data.
constexpr std::uint8_t descriptor[] = {
    0x06, 0x4C,
    0xFF,                   // Usage Page (vendor-defined 0xFF4C)
    0x09, 0x01,             // Usage (1: glove)
    0xA1, 0x01,             // Collection (Application)
    0x85, glove_report_id,  //   Report ID (1)
    0x09, 0x02,             //   Usage (2: input report)
    0x15, 0x00,             //   Logical Minimum (0)
    0x26, 0xFF,
    0x00,                         //   Logical Maximum (255)
    0x75, 0x08,                   //   Report Size (8 bits)
    0x95, glove_report_size - 1,  //   Report Count (63; the id comes on top)
    0x81, 0x02,                   //   Input (Data, Variable, Absolute)
    0xC0,                         // End Collection
};

}  // namespace

Result<GloveReport> parse_glove_report(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != glove_report_size) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} bytes, expected {}", bytes.size(), glove_report_size), "length");
  }
  if (bytes[at_id] != glove_report_id) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {}, expected {}", bytes[at_id], glove_report_id), "report_id");
  }
  if (bytes[at_version] != glove_report_version) {
    return make_error(ErrorCode::unsupported,
                      fmt::format("found {}, expected {}", bytes[at_version], glove_report_version),
                      "version");
  }
  const std::uint32_t expected = crc32(bytes.first(at_checksum));
  const std::uint32_t found = read_u32(bytes, at_checksum);
  if (found != expected) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {:#010x}, expected {:#010x}", found, expected), "checksum");
  }
  GloveReport report;
  report.flags = read_u16(bytes, at_flags);
  report.sequence = read_u16(bytes, at_sequence);
  report.device_time_us = read_u32(bytes, at_time);
  report.force = read_u16(bytes, at_force);
  report.potentiometer = read_u16(bytes, at_potentiometer);
  report.contacts = read_u16(bytes, at_contacts);
  report.battery_percent = bytes[at_battery];
  if ((report.flags & ~glove_flags_all) != 0) return unknown_bits("flags", report.flags, glove_flags_all);
  if (report.force > glove_analogue_max) return out_of_range("force", report.force, glove_analogue_max);
  if (report.potentiometer > glove_analogue_max) {
    return out_of_range("potentiometer", report.potentiometer, glove_analogue_max);
  }
  if ((report.contacts & ~contact_all) != 0) return unknown_bits("contacts", report.contacts, contact_all);
  if (report.battery_percent > 100) return out_of_range("battery", report.battery_percent, 100);
  for (std::size_t i = at_reserved; i < at_checksum; ++i) {
    if (bytes[i] != 0) return out_of_range("reserved", bytes[i], 0);
  }
  return report;
}

std::array<std::uint8_t, glove_report_size> encode_glove_report(const GloveReport& report) {
  std::array<std::uint8_t, glove_report_size> bytes{};
  bytes[at_id] = glove_report_id;
  bytes[at_version] = glove_report_version;
  write_u16(bytes, at_flags, report.flags);
  write_u16(bytes, at_sequence, report.sequence);
  write_u32(bytes, at_time, report.device_time_us);
  write_u16(bytes, at_force, report.force);
  write_u16(bytes, at_potentiometer, report.potentiometer);
  write_u16(bytes, at_contacts, report.contacts);
  bytes[at_battery] = report.battery_percent;
  write_u32(bytes, at_checksum, crc32(std::span(bytes).first(at_checksum)));
  return bytes;
}

std::span<const std::uint8_t> glove_report_descriptor() {
  return descriptor;
}

}  // namespace handloft::tracking
