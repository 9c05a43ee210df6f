#pragma once
// What a LucidGloves glove's values mean to us (T9, T10). It has potentiometers at its fingers where ours has
// contact pads, so contacts are made of curl with hysteresis; they are debounced like pads after that.
//
//   curl of index, middle, ring, little, thumb (B to E, A)   that finger's contact: closed above `flexed_on`
//   of
//                                                            the range, open again below `flexed_off`
//   trigger's value (P), else the pinch button (M) as full   pressure
//   joystick y (G)                                           potentiometer; without one half of its range
//   `table_button` (K, the B button)                         hand on the table: there is no pad for it
//
// Per-finger ranges follow what is seen (the firmware's own calibration may be off): a finger counts once it
// has moved by an eighth of the converter's range.

#include <array>
#include <cstdint>

#include "daemon-tracking/source/glove/serial_glove_line.h"
#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {

/// Where pressure comes from.
enum class SerialPressure : std::uint8_t { trigger_or_pinch, index_curl };

struct SerialGloveMapping {
  std::uint16_t largest = serial_glove_largest;  ///< Of the board's converter: 4095 on an ESP32, 1023 on AVR.
  double flexed_on = 0.6;                        ///< Of the finger's range.
  double flexed_off = 0.5;
  SerialPressure pressure = SerialPressure::trigger_or_pinch;
  std::uint16_t table_button = serial_b;
};

class SerialGloveMapper {
 public:
  explicit SerialGloveMapper(const SerialGloveMapping& mapping = {}) : mapping_(mapping) {}

  /// The line as the report that our glove would have sent; without sequence and device time. A value that
  /// the line lacks stays as it was.
  GloveReport map(const SerialGloveLine& line);
  void reset() { *this = SerialGloveMapper(mapping_); }

 private:
  struct Finger {
    bool seen = false;
    bool flexed = false;
    std::uint16_t low = 0, high = 0;  // Of what was seen
    double curl = 0.0;                // 0..1 of that
  };

  SerialGloveMapping mapping_;
  std::array<Finger, finger_count> fingers_;
  double trigger_ = 0.0;
  double joystick_y_ = 0.5;
};

}  // namespace handloft::tracking
