#pragma once
// Timestamped samples: all that a device, real, recorded or simulated, ever hands on. Everything behind the
// sources is a deterministic function of the sequence of samples, so a recording replays to the same bits
// (T13).

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/base/clock.h"

namespace handloft::tracking {

enum class PixelFormat : std::uint8_t { mjpeg = 1, yuyv = 2, grey = 3 };

/// One frame as the camera delivered it (still compressed). The bytes are shared, never changed.
struct CameraFrame {
  std::uint32_t camera = 0;    ///< Index into the rig's list of cameras.
  std::uint64_t sequence = 0;  ///< The driver's counter; gaps are dropped frames.
  TimePoint capture_time;      ///< Middle of the exposure on CLOCK_MONOTONIC (T4).
  TimePoint arrival_time;      ///< When the bytes were ours.
  PixelFormat format = PixelFormat::mjpeg;
  int width_px = 0;
  int height_px = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
};

/// One HID report of the glove as raw bytes (T9); parsed by glove_report.h.
struct GloveBytes {
  TimePoint arrival_time;
  std::vector<std::uint8_t> bytes;  ///< At most 64.
};

/// What the bytes of a DeviceBytes sample are.
enum class DeviceData : std::uint8_t {
  space_mouse_report = 1,  ///< One HID input report, id in front (space_mouse/space_mouse_report.h).
  pen_facts = 2,           ///< A tablet's axes, before its first events (pen/pen_events.h).
  pen_events = 3,          ///< Input events up to a SYN_REPORT, with the kernel's times (pen/pen_events.h).
  serial_glove_line = 4,   ///< One line of a LucidGloves glove without its end (glove/serial_glove_line.h).
};

/// Bytes of any other device, unparsed: the parsers run behind the recording and are replayed too (T13).
struct DeviceBytes {
  TimePoint
      arrival_time;  ///< When the bytes were ours; a device that knows better says so in its bytes (T4).
  DeviceData kind = DeviceData::space_mouse_report;
  std::vector<std::uint8_t> bytes;  ///< At most 4096.
};

/// A device came or went (T3). A glove that went releases every contact.
struct DevicePresence {
  TimePoint time;
  std::string device;  ///< "glove", "pen", "space_mouse", "camera/left"
  bool present = false;
};

/// The simulated rig's truth at a frame's exposure: what the pipeline is measured against, never read by it.
struct Truth {
  TimePoint time;
  bool hand_present = false;
  double fingertips_m[5][3] = {};  ///< thumb, index, middle, ring, little; world frame
  double head_position_m[3] = {};  ///< world_from_head
  double head_orientation_wxyz[4] = {1, 0, 0, 0};
  double pressure = 0.0;  ///< 0..1
};

using Sample = std::variant<CameraFrame, GloveBytes, DevicePresence, Truth, DeviceBytes>;

}  // namespace handloft::tracking
