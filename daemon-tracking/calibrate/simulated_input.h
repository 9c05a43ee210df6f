#pragma once
// What the simulated rig shows to each step, as a person would who follows the guide.

#include <memory>
#include <string>

#include "daemon-tracking/calibrate/options.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

std::unique_ptr<SampleStream> simulated_input(const CalibrateOptions& options);

}  // namespace handloft::tracking
