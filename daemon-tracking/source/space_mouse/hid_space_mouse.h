#pragma once
// A real 3D mouse over HID: hidapi over hidraw. A device suits when its report descriptor says that it is a
// multi-axis controller or its numbers are known; what happens otherwise stands in hid/hid_reader.h.

#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "daemon-tracking/source/hid/hid_device.h"
#include "daemon-tracking/source/hotplug.h"
#include "daemon-tracking/source/space_mouse/space_mouse_source.h"

namespace handloft::tracking {

struct HidSpaceMouseOptions {
  std::string serial;  ///< Of the one that is meant; empty: the first that comes.
};

/// `hotplug` must watch "hidraw"; it and `clock` must outlive the source. start() succeeds without a mouse
/// too.
std::unique_ptr<SpaceMouseSource> make_hid_space_mouse(const HidSpaceMouseOptions& options,
                                                       HotplugMonitor& hotplug,
                                                       std::shared_ptr<HidSystem> system, const Clock& clock,
                                                       Logger log);

}  // namespace handloft::tracking
