#pragma once
// A camera as the daemon sees it (T1): delivers CameraFrame samples of one camera of the rig, and
// DevicePresence when it comes or goes. Implementations beside this file: simulated_camera.h,
// recorded_camera.h; the V4L2 camera joins them here.

#include <cstdint>

#include "daemon-tracking/source/sample_source.h"

namespace handloft::tracking {

class CameraSource : public SampleSource {
 public:
  /// Index into Rig::cameras; equals CameraFrame::camera of every frame delivered.
  virtual std::uint32_t camera() const = 0;
};

}  // namespace handloft::tracking
