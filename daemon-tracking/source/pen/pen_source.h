#pragma once
// A pen tablet as the daemon sees it (T1): delivers DevicePresence "pen", then DeviceBytes of kind pen_facts
// once and pen_events for each frame of events. Implementations: evdev_pen.h; simulated and recorded in
// pen_streams.h.

#include "daemon-tracking/source/device_status.h"
#include "daemon-tracking/source/sample_source.h"

namespace handloft::tracking {

inline constexpr const char* pen_device = "pen";

class PenSource : public SampleSource {
 public:
  virtual DeviceStatus status() const { return {}; }
};

}  // namespace handloft::tracking
