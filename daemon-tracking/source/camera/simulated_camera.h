#pragma once
// A simulated camera behind the daemon's camera interface: renders ahead and delivers when the clock says so.

#include <memory>

#include "daemon-tracking/source/camera/camera_source.h"
#include "daemon-tracking/source/paced_source.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"

namespace handloft::tracking {

/// Delivers the CameraFrame, Truth and DevicePresence samples of camera `camera` of the scene's rig.
std::unique_ptr<CameraSource> make_simulated_camera(std::shared_ptr<const SimulatedScene> scene,
                                                    std::uint32_t camera, const Clock& clock,
                                                    PaceOptions options = {});

}  // namespace handloft::tracking
