#pragma once
// A recorded camera behind the daemon's camera interface.

#include <filesystem>
#include <memory>

#include "daemon-tracking/source/camera/camera_source.h"
#include "daemon-tracking/source/paced_source.h"
#include "daemon-tracking/source/rig.h"

namespace handloft::tracking {

/// Frames and presence of camera `camera` of the rig. Errors: as RecordedStream::open; invalid_argument when
/// the rig has no such camera.
Result<std::unique_ptr<CameraSource>> open_recorded_camera(const std::filesystem::path& path, const Rig& rig,
                                                           std::uint32_t camera, const Clock& clock,
                                                           PaceOptions options = {});

}  // namespace handloft::tracking
