#pragma once
// Live cameras (V4L2) and the glove (HID) as one stream that ends after the options' time.

#include "common/base/result.h"
#include "daemon-tracking/calibrate/input.h"
#include "daemon-tracking/calibrate/options.h"

namespace handloft::tracking {

/// Opens the wanted cameras, or for the step "glove" the glove. Errors: not_found naming what is there;
/// those of the selectors.
Result<Input> open_live(const CalibrateOptions& options, const Calibration& calibration);

}  // namespace handloft::tracking
