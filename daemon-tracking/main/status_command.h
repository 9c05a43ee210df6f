#pragma once
// `handloft-trackd status`: what a running daemon says of its devices, and how old its frames are (T14, T15).

#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/main/options.h"
#include "proto/tracking.pb.h"

namespace handloft::tracking {

/// Subscribes to the daemon at DaemonOptions::listen until a frame tells of its devices. Errors: not_found
/// (nobody listens), timeout, and those of the network.
Result<v1::TrackingFrame> ask_status(const DaemonOptions& options, const Clock& clock);

/// A line a device, the latency, the alarms; `age_s`: of the frame. No daemon text reaches a terminal raw:
/// control characters are replaced.
std::string status_text(const v1::TrackingFrame& frame, double age_s);
std::string status_json(const v1::TrackingFrame& frame, double age_s);

/// Prints to standard output; the exit status: 0, or 1 when a device has an alarm or nobody answers.
int run_status(const DaemonOptions& options, const Clock& clock);

}  // namespace handloft::tracking
