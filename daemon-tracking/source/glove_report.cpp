#include "daemon-tracking/source/glove_report.h"

#include <fmt/format.h>

namespace handloft::tracking {
namespace {

// Offsets of the layout in glove_report.h.
constexpr std::size_t at_id = 0, at_version = 1, at_flags = 2, at_sequence = 4, at_time = 6, at_force = 10;
constexpr std::size_t at_potentiometer = 12, at_contacts = 14, at_battery = 16, at_reserved = 17,
                      at_checksum = 60;
constexpr std::size_t range_at_force_zero = 2, range_at_force_full = 4, range_at_potentiometer_low = 6;
constexpr std::size_t range_at_potentiometer_high = 8, range_at_flags = 10, range_at_checksum = 12;
constexpr std::size_t output_at_red = 2, output_at_vibration = 5, output_at_length = 6;

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

// clang-format off
// USB HID 1.11 section 6.2.2: short items, the low two bits of each prefix are the length of its data.
constexpr std::uint8_t descriptor[] = {
    0x06, 0x4C, 0xFF,                   // Usage Page (vendor-defined 0xFF4C)
    0x09, glove_usage,                  // Usage (1: glove)
    0xA1, 0x01,                         // Collection (Application)
    0x15, 0x00,                         //   Logical Minimum (0)
    0x26, 0xFF, 0x00,                   //   Logical Maximum (255)
    0x75, 0x08,                         //   Report Size (8 bits)
    0x85, glove_report_id,              //   Report ID (1); the id comes on top of each count
    0x95, glove_report_size - 1,        //   Report Count (63)
    0x09, 0x02,                         //   Usage (2: state)
    0x81, 0x02,                         //   Input (Data, Variable, Absolute)
    0x85, glove_output_id,              //   Report ID (2)
    0x95, glove_output_size - 1,        //   Report Count (7)
    0x09, 0x03,                         //   Usage (3: light and vibration)
    0x91, 0x02,                         //   Output (Data, Variable, Absolute)
    0x85, glove_range_id,               //   Report ID (3)
    0x95, glove_range_size - 1,         //   Report Count (15)
    0x09, 0x04,                         //   Usage (4: range)
    0xB1, 0x02,                         //   Feature (Data, Variable, Absolute)
    0xC0,                               // End Collection
};
// clang-format on

Status check_head(std::span<const std::uint8_t> bytes, std::size_t size, std::uint8_t id) {
  if (bytes.size() != size) {
    return make_error(ErrorCode::data_corrupt, fmt::format("found {} bytes, expected {}", bytes.size(), size),
                      "length");
  }
  if (bytes[at_id] != id) {
    return make_error(ErrorCode::data_corrupt, fmt::format("found {}, expected {}", bytes[at_id], id),
                      "report_id");
  }
  if (bytes[at_version] != glove_report_version) {
    return make_error(ErrorCode::unsupported,
                      fmt::format("found {}, expected {}", bytes[at_version], glove_report_version),
                      "version");
  }
  return {};
}

Status check_crc(std::span<const std::uint8_t> bytes, std::size_t at) {
  const std::uint32_t expected = crc32(bytes.first(at));
  const std::uint32_t found = read_u32(bytes, at);
  if (found == expected) return {};
  return make_error(ErrorCode::data_corrupt,
                    fmt::format("found {:#010x}, expected {:#010x}", found, expected), "checksum");
}

Status check_ends(const char* field, std::uint16_t low, std::uint16_t high) {
  if (high > glove_analogue_max) return out_of_range(field, high, glove_analogue_max);
  if (low < high) return {};
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found {}..{}, expected a rising range", low, high), field);
}

}  // namespace

Result<GloveReport> parse_glove_report(std::span<const std::uint8_t> bytes) {
  if (Status status = check_head(bytes, glove_report_size, glove_report_id); !status) return status.error();
  if (Status status = check_crc(bytes, at_checksum); !status) return status.error();
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

Result<GloveRange> parse_glove_range(std::span<const std::uint8_t> bytes) {
  if (Status status = check_head(bytes, glove_range_size, glove_range_id); !status) return status.error();
  if (Status status = check_crc(bytes, range_at_checksum); !status) return status.error();
  GloveRange range;
  range.force_zero = read_u16(bytes, range_at_force_zero);
  range.force_full = read_u16(bytes, range_at_force_full);
  range.potentiometer_low = read_u16(bytes, range_at_potentiometer_low);
  range.potentiometer_high = read_u16(bytes, range_at_potentiometer_high);
  const std::uint16_t flags = read_u16(bytes, range_at_flags);
  if (flags > 1) return unknown_bits("flags", flags, 1);
  range.calibrated = flags == 1;
  if (Status status = check_ends("force", range.force_zero, range.force_full); !status) return status.error();
  if (Status status = check_ends("potentiometer", range.potentiometer_low, range.potentiometer_high); !status)
    return status.error();
  return range;
}

std::array<std::uint8_t, glove_range_size> encode_glove_range(const GloveRange& range) {
  std::array<std::uint8_t, glove_range_size> bytes{};
  bytes[at_id] = glove_range_id;
  bytes[at_version] = glove_report_version;
  write_u16(bytes, range_at_force_zero, range.force_zero);
  write_u16(bytes, range_at_force_full, range.force_full);
  write_u16(bytes, range_at_potentiometer_low, range.potentiometer_low);
  write_u16(bytes, range_at_potentiometer_high, range.potentiometer_high);
  write_u16(bytes, range_at_flags, range.calibrated ? 1 : 0);
  write_u32(bytes, range_at_checksum, crc32(std::span(bytes).first(range_at_checksum)));
  return bytes;
}

Result<GloveOutput> parse_glove_output(std::span<const std::uint8_t> bytes) {
  if (Status status = check_head(bytes, glove_output_size, glove_output_id); !status) return status.error();
  const GloveOutput output{bytes[output_at_red], bytes[output_at_red + 1], bytes[output_at_red + 2],
                           bytes[output_at_vibration], read_u16(bytes, output_at_length)};
  if (output.vibration_ms > glove_longest_pulse_ms)
    return out_of_range("vibration_ms", output.vibration_ms, glove_longest_pulse_ms);
  return output;
}

std::array<std::uint8_t, glove_output_size> encode_glove_output(const GloveOutput& output) {
  std::array<std::uint8_t, glove_output_size> bytes{};
  bytes[at_id] = glove_output_id;
  bytes[at_version] = glove_report_version;
  bytes[output_at_red] = output.red;
  bytes[output_at_red + 1] = output.green;
  bytes[output_at_red + 2] = output.blue;
  bytes[output_at_vibration] = output.vibration;
  write_u16(bytes, output_at_length, output.vibration_ms);
  return bytes;
}

std::span<const std::uint8_t> glove_report_descriptor() {
  return descriptor;
}

}  // namespace handloft::tracking
