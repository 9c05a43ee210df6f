#pragma once
// The glove as the daemon sees it (T1, T9): delivers GloveBytes samples, one per HID report, unparsed, and
// DevicePresence when it comes or goes. Implementations beside this file: simulated_glove.h,
// recorded_glove.h; the hidapi glove joins them here.

#include "daemon-tracking/source/sample_source.h"

namespace handloft::tracking {

class GloveSource : public SampleSource {};

}  // namespace handloft::tracking
