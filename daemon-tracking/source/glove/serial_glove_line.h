#pragma once
// One line of a LucidGloves-compatible glove: its "alpha encoding" over a serial line at 115200 baud. Every
// value stands behind a letter; what a glove lacks is left out, and the order is free:
//
//   A2047 B1023 C0 D0 E4095     curl of thumb, index, middle, ring, little finger (here with spaces; there
//   are none) (AB)512                     splay of a finger; (AAA), (AAB), ... bend of single joints F2047
//   G2047 H               joystick x, y, and its button I J K L M N O               trigger, A, B, grab,
//   pinch, menu, calibrate: there while pressed P1023                       trigger's value
//
// Numbers go up to the converter's largest value: 1023 on AVR boards, 4095 on ESP32. There is no checksum,
// sequence or time in a line, so it is stamped at its arrival (T4 has nothing better) and judged by its form
// alone. Pure; hostile bytes give an error, never more.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "daemon-tracking/source/rig.h"

namespace handloft::tracking {

inline constexpr std::size_t max_serial_glove_line = 512;  ///< With every joint some 200.
inline constexpr std::uint16_t serial_glove_largest = 4095;

enum SerialGloveButton : std::uint16_t {
  serial_joystick = 1u << 0,
  serial_trigger = 1u << 1,
  serial_a = 1u << 2,
  serial_b = 1u << 3,
  serial_grab = 1u << 4,
  serial_pinch = 1u << 5,
  serial_menu = 1u << 6,
  serial_calibrate = 1u << 7,
};

struct SerialGloveLine {
  std::array<std::optional<std::uint16_t>, finger_count> curl;  ///< By Finger
  std::optional<std::uint16_t> joystick_x, joystick_y, trigger;
  std::uint16_t buttons = 0;

  bool operator==(const SerialGloveLine&) const = default;
};

/// The line without its end; a carriage return at the end is ignored. Errors: data_corrupt (too long, an
/// unknown letter, a value missing or twice), invalid_argument (a number above 4095); the field is the
/// letter.
Result<SerialGloveLine> parse_serial_glove_line(std::span<const std::uint8_t> line);

/// A line as a glove writes it, without its end.
std::string encode_serial_glove_line(const SerialGloveLine& line);

/// Cuts a stream of bytes into lines, bounded: an endless line is dropped up to its end and counted.
class LineCutter {
 public:
  /// Calls `take(std::span<const uint8_t>)` for each complete line that is not empty.
  template <typename Take>
  void feed(std::span<const std::uint8_t> bytes, const Take& take) {
    for (const std::uint8_t byte : bytes) {
      if (byte != '\n') {
        if (size_ == line_.size()) {
          overflowing_ = true;
        } else {
          line_[size_++] = byte;
        }
        continue;
      }
      if (overflowing_) {
        ++dropped_;
      } else if (size_ > 0) {
        take(std::span<const std::uint8_t>(line_).first(size_));
      }
      size_ = 0;
      overflowing_ = false;
    }
  }
  /// The rest of a line whose beginning was missed is no line: begins to look for the next one's start.
  void skip_to_next() {
    size_ = line_.size();
    overflowing_ = true;
  }
  std::uint64_t dropped() const { return dropped_; }

 private:
  std::array<std::uint8_t, max_serial_glove_line> line_{};
  std::size_t size_ = 0;
  bool overflowing_ = false;
  std::uint64_t dropped_ = 0;
};

}  // namespace handloft::tracking
