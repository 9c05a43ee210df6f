#pragma once
// `handloft-trackd doctor`: everything of doctor_checks.h on this computer.

#include "common/base/clock.h"
#include "daemon-tracking/main/options.h"

namespace handloft::tracking {

/// Prints to standard output; the exit status: 0, or 1 when something fails.
int run_doctor(const DaemonOptions& options, const Clock& clock);

}  // namespace handloft::tracking
