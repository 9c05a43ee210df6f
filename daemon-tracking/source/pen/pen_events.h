#pragma once
// A pen tablet's input events as the kernel gives them (linux/input.h), and the facts that give their numbers
// a unit. Both are what a recording keeps (T13); little-endian:
//
//   pen_facts    u8 version (1); then for x, y, pressure, tilt x, tilt y each: u8 present (0, 1), i32
//   minimum,
//                i32 maximum, i32 resolution (units per mm; units per radian for tilt; 0 unknown)
//   pen_events   one or more of: i64 time in ns on CLOCK_MONOTONIC, u16 type, u16 code, i32 value
//
// Events are what libevdev hands on: after a SYN_DROPPED (the kernel's buffer overran) come the differences
// between what was known and what is, up to a SYN_REPORT, so that nothing stays wrong. Pure, for hostile
// bytes too.

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"

namespace handloft::tracking {

struct PenAxis {
  bool present = false;
  std::int32_t minimum = 0;
  std::int32_t maximum = 0;
  std::int32_t resolution = 0;  ///< Units per mm, or per radian for tilt; 0: unknown

  bool operator==(const PenAxis&) const = default;
};

struct PenFacts {
  PenAxis x, y, pressure, tilt_x, tilt_y;

  bool operator==(const PenFacts&) const = default;
};

struct PenEvent {
  TimePoint time;
  std::uint16_t type = 0;
  std::uint16_t code = 0;
  std::int32_t value = 0;

  bool operator==(const PenEvent&) const = default;
};

inline constexpr std::size_t pen_event_size = 16;
inline constexpr std::size_t max_pen_events = 256;  ///< In one sample.

std::vector<std::uint8_t> encode_pen_facts(const PenFacts& facts);
/// Errors: data_corrupt (length), unsupported (version), invalid_argument (a range that is empty, a negative
/// resolution, x or y missing); the field names the axis.
Result<PenFacts> parse_pen_facts(std::span<const std::uint8_t> bytes);

/// At most max_pen_events of them.
std::vector<std::uint8_t> encode_pen_events(std::span<const PenEvent> events);
/// Errors: data_corrupt (a length that is no whole number of events, or none, or too many).
Result<std::vector<PenEvent>> parse_pen_events(std::span<const std::uint8_t> bytes);

}  // namespace handloft::tracking
