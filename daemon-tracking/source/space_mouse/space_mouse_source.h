#pragma once
// A 3D mouse as the daemon sees it (T1): delivers DeviceBytes of kind space_mouse_report and DevicePresence
// "space_mouse". Implementations: hid_space_mouse.h; simulated and recorded in space_mouse_streams.h.

#include "daemon-tracking/source/device_status.h"
#include "daemon-tracking/source/sample_source.h"

namespace handloft::tracking {

inline constexpr const char* space_mouse_device = "space_mouse";

class SpaceMouseSource : public SampleSource {
 public:
  virtual DeviceStatus status() const { return {}; }
};

}  // namespace handloft::tracking
