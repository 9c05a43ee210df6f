#pragma once
// The glove's HID reports (T9). Input: what the firmware sends 250 times a second over USB, vendor-defined
// usage page 0xFF4C, one report of 64 bytes with the report id in front. All numbers little-endian.
//
//   byte  0      report id, 1
//   byte  1      layout version, 1
//   bytes 2..3   flags (u16): bit 0 charging, bit 1 the device's time or sequence was reset; others 0
//   bytes 4..5   sequence (u16), wraps
//   bytes 6..9   device time (u32), microseconds, wraps after 71.6 minutes
//   bytes 10..11 force on the pressure sensor (u16), 0..1023
//   bytes 12..13 potentiometer (u16), 0..1023
//   bytes 14..15 contact bits (u16), see `Contact`; others 0
//   byte  16     battery, 0..100 percent
//   bytes 17..59 reserved, 0
//   bytes 60..63 CRC-32 (IEEE 802.3, as zlib's crc32) of bytes 0..59
//
// Feature report, 16 bytes, both ways: the range of this glove's sensors, kept in its EEPROM, so that a glove
// is calibrated wherever it is plugged in. Reports stay raw; the range is applied by the daemon.
//
//   byte  0      report id, 3
//   byte  1      layout version, 1
//   bytes 2..3   force at rest (u16), 0..1023
//   bytes 4..5   force at full pressure (u16), above it
//   bytes 6..7   potentiometer at its lower end (u16), 0..1023
//   bytes 8..9   potentiometer at its upper end (u16), above it
//   bytes 10..11 flags (u16): bit 0 the range was calibrated (0: never, and the range is the whole); others 0
//   bytes 12..15 CRC-32 of bytes 0..11
//
// Output report, 8 bytes: status light and one pulse of vibration.
//
//   byte  0      report id, 2
//   byte  1      layout version, 1
//   bytes 2..4   red, green, blue, 0..255
//   byte  5      vibration, 0 (none) .. 255
//   bytes 6..7   length of the pulse (u16) in ms, 0..1000
//
// The parser treats the bytes as hostile: fixed length, every field range-checked, reserved bytes must be
// zero, so that a later version can use them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/result.h"

namespace handloft::tracking {

inline constexpr std::size_t glove_report_size = 64;
inline constexpr std::uint8_t glove_report_id = 1;
inline constexpr std::uint8_t glove_report_version = 1;
inline constexpr std::uint16_t glove_analogue_max = 1023;  ///< Force and potentiometer: a 10-bit converter.
inline constexpr std::uint16_t glove_usage_page = 0xFF4C;  ///< Vendor-defined.
inline constexpr std::uint16_t glove_usage = 1;
/// pid.codes' numbers for devices that never leave the laboratory; whoever sells gloves gets his own. The
/// usage page decides, not these, but where only libusb sees the device.
inline constexpr std::uint16_t glove_usb_vendor = 0x1209;
inline constexpr std::uint16_t glove_usb_product = 0x0001;

inline constexpr std::size_t glove_range_size = 16;
inline constexpr std::uint8_t glove_range_id = 3;
inline constexpr std::size_t glove_output_size = 8;
inline constexpr std::uint8_t glove_output_id = 2;
inline constexpr std::uint16_t glove_longest_pulse_ms = 1000;

/// Contact pads, as bits of GloveReport::contacts. A finger's bit is set while the finger is flexed onto the
/// palm's pad.
enum Contact : std::uint16_t {
  contact_index = 1u << 0,
  contact_middle = 1u << 1,
  contact_ring = 1u << 2,
  contact_little = 1u << 3,
  contact_thumb = 1u << 4,  ///< Thumb pad: thumb laid onto the hand.
  contact_table = 1u << 5,  ///< Pad under the hand: the hand lies on the table.
};
inline constexpr std::uint16_t contact_all = 0x3F;

enum GloveFlag : std::uint16_t {
  glove_charging = 1u << 0,
  glove_restarted = 1u << 1,
};
inline constexpr std::uint16_t glove_flags_all = 0x3;

struct GloveReport {
  std::uint16_t flags = 0;
  std::uint16_t sequence = 0;
  std::uint32_t device_time_us = 0;
  std::uint16_t force = 0;          ///< 0..1023, 0 = nothing pressed
  std::uint16_t potentiometer = 0;  ///< 0..1023
  std::uint16_t contacts = 0;       ///< Raw bits of `Contact`: not debounced.
  std::uint8_t battery_percent = 100;

  bool operator==(const GloveReport&) const = default;
};

/// Reads one report. Errors: `data_corrupt` (length, report id, checksum), `unsupported` (version),
/// `invalid_argument` (a field out of its range); `Error::field` names the field. Pure; never allocates but
/// for an error's text.
Result<GloveReport> parse_glove_report(std::span<const std::uint8_t> bytes);

/// The bytes of a report: what the firmware (and the simulated glove) sends. Fields out of range are written
/// as they are, so that tests can make bad reports.
std::array<std::uint8_t, glove_report_size> encode_glove_report(const GloveReport& report);

/// What this glove's sensors say at rest and at their ends.
struct GloveRange {
  std::uint16_t force_zero = 0;
  std::uint16_t force_full = glove_analogue_max;
  std::uint16_t potentiometer_low = 0;
  std::uint16_t potentiometer_high = glove_analogue_max;
  bool calibrated = false;

  bool operator==(const GloveRange&) const = default;
};

/// Errors: as parse_glove_report; invalid_argument too when an upper end isn't above its lower one.
Result<GloveRange> parse_glove_range(std::span<const std::uint8_t> bytes);
std::array<std::uint8_t, glove_range_size> encode_glove_range(const GloveRange& range);

struct GloveOutput {
  std::uint8_t red = 0, green = 0, blue = 0;
  std::uint8_t vibration = 0;  ///< 0: none
  std::uint16_t vibration_ms = 0;

  bool operator==(const GloveOutput&) const = default;
};

/// Errors: as parse_glove_report.
Result<GloveOutput> parse_glove_output(std::span<const std::uint8_t> bytes);
std::array<std::uint8_t, glove_output_size> encode_glove_output(const GloveOutput& output);

/// The HID report descriptor of the device (USB HID 1.11, section 6.2.2): input report 1 with 63 bytes,
/// output report 2 with 7 and feature report 3 with 15 after their ids.
std::span<const std::uint8_t> glove_report_descriptor();

}  // namespace handloft::tracking
