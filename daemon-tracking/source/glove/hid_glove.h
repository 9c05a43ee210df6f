#pragma once
// A real glove over USB HID (T9): hidapi over hidraw, over libusb where there is no hidraw node. What it does
// when the device is absent, foreign, silent or may not be opened stands in hid/hid_reader.h.
//
// It delivers, in this order: DevicePresence "glove" present; the range report if the glove has one, as
// GloveBytes; then every input report as GloveBytes with its arrival. The device's own time is in the bytes
// and is put on our clock behind the recording (device_clock.h, fusion/glove_tracker.h).

#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "daemon-tracking/source/glove/glove_source.h"
#include "daemon-tracking/source/hid/hid_device.h"
#include "daemon-tracking/source/hid/hid_reader.h"
#include "daemon-tracking/source/hotplug.h"

namespace handloft::tracking {

struct HidGloveOptions {
  std::string serial;  ///< Of the one glove that is meant; empty: the first that comes.
  std::uint16_t vendor_id = glove_usb_vendor;
  std::uint16_t product_id = glove_usb_product;
  Duration silent_after = std::chrono::seconds(1);     ///< See HidReaderOptions.
  Duration wait_for_hidraw = std::chrono::seconds(3);  ///< See HidReaderOptions.
};

/// `hotplug` must watch "hidraw", and "usb" for the fallback; it and `clock` must outlive the source. start()
/// succeeds without a glove too.
std::unique_ptr<GloveSource> make_hid_glove(const HidGloveOptions& options, HotplugMonitor& hotplug,
                                            std::shared_ptr<HidSystem> system, const Clock& clock,
                                            Logger log);

}  // namespace handloft::tracking
