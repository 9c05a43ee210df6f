#pragma once
// Samples as bytes, for the recording (T13). Little-endian, no padding; the first byte is the kind of sample:
//
//   1 CameraFrame     u32 camera, u64 sequence, i64 capture ns, i64 arrival ns, u8 format, u16 width, u16
//   height,
//                     u32 length, bytes
//   2 GloveBytes      i64 arrival ns, u8 length, bytes
//   3 DevicePresence  i64 time ns, u8 present (0, 1), u8 length, device name (UTF-8)
//   4 Truth           i64 time ns, u8 hand present (0, 1), 15 + 3 + 4 + 1 doubles
//   5 DeviceBytes     i64 arrival ns, u8 what they are (DeviceData), u16 length, bytes
//
// Bounded both ways: a hostile file can't make us allocate more than its own size.

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

inline constexpr std::size_t max_frame_bytes = 8u << 20;  ///< A 4K MJPEG frame at best quality is below this.
inline constexpr std::size_t max_frame_edge_px = 8192;
inline constexpr std::size_t max_device_name = 255;
inline constexpr std::size_t max_device_bytes = 4096;  ///< A frame of pen events is some 200.

/// Errors: invalid_argument or resource_exhausted when a field doesn't fit the layout (too many bytes, NaN).
Result<std::vector<std::uint8_t>> encode_sample(const Sample& sample);

/// Errors: data_corrupt (truncated, trailing bytes), unsupported (kind, format), invalid_argument (a value
/// out of range); `Error::field` names the field.
Result<Sample> decode_sample(std::span<const std::uint8_t> bytes);

}  // namespace handloft::tracking
