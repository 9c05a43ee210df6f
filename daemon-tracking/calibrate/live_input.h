#pragma once
// Live cameras (V4L2) and the glove (HID) as one stream that ends after the options' time.

#include "common/base/result.h"
#include "daemon-tracking/calibrate/input.h"
#include "daemon-tracking/calibrate/options.h"
#include "daemon-tracking/source/hotplug.h"

namespace handloft::tracking {

/// Opens the wanted cameras, or for the step "glove" the glove. Errors: not_found naming what is there;
/// those of the selectors.
Result<Input> open_live(const CalibrateOptions& options, const Calibration& calibration);

/// The glove among what is plugged in; nullopt for none.
std::optional<DeviceIdentity> glove_identity(const std::vector<PluggedDevice>& present);

}  // namespace handloft::tracking
