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

/// A device came or went (T3). A glove that went releases every contact.
struct DevicePresence {
  TimePoint time;
  std::string device;  ///< "glove", "camera/left"
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

using Sample = std::variant<CameraFrame, GloveBytes, DevicePresence, Truth>;

}  // namespace handloft::tracking
