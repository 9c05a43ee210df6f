#pragma once
// Questions to an opened /dev/videoN: what it is, and which sizes and rates it has.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/camera/v4l2_modes.h"
#include "daemon-tracking/source/camera/v4l2_system.h"

namespace handloft::tracking {

enum class NodeKind {
  capture,        ///< Single-planar video capture with streaming: what the daemon reads.
  multi_planar,   ///< A capture node of another interface (embedded camera pipelines).
  not_streaming,  ///< Captures, but only by read().
  other,          ///< Metadata, output, memory to memory: no camera.
};

struct NodeCapability {
  NodeKind kind = NodeKind::other;
  std::string driver, card, bus_info;
};

/// Errors: those of camera_error().
Result<NodeCapability> query_capability(V4l2System& system, int fd, const std::string& node);

/// The formats that the daemon decodes, at most a few hundred entries; empty when there is none of them.
/// Drivers that name ranges instead of lists are asked for common sizes and rates within them, and for those
/// of `wish`.
std::vector<VideoSize> query_sizes(V4l2System& system, int fd, const ModeWish& wish = {});

/// The kernel's four-character code to ask for. JPEG is read as well as MJPG, but only MJPG is asked for: a
/// driver that has JPEG alone takes the one for the other.
std::uint32_t fourcc_of(PixelFormat format);
/// Nullopt for what the daemon doesn't decode.
std::optional<PixelFormat> format_of(std::uint32_t fourcc);

}  // namespace handloft::tracking
