#pragma once
// The running daemon: samples in, published frames out.
//
// Live (real time), a worker a camera does that camera's vision on its newest frame, and one fusion thread
// owns all filter state. A recording is written in the order in which the fusion consumed, so that a replay,
// which is one thread from end to end, gives the same bits (T13). No thread waits for a subscriber, but for a
// replay's.

#include <functional>
#include <optional>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "daemon-tracking/main/options.h"
#include "daemon-tracking/main/report.h"

namespace handloft::tracking {

/// Asked often; true: end in order.
using StopRequested = std::function<bool()>;

/// A session that came to its end.
struct Session {
  SessionFigures figures;
  /// What went wrong on the way without ending it: the new recording could not be written to its end, or the
  /// replayed one is damaged.
  std::optional<Error> problem;
};

/// Runs until the source ends (with exit_at_end) or a stop is requested. Errors only where it can't start.
Result<Session> run_daemon(const DaemonOptions& options, const Clock& clock, const Logger& log,
                           const StopRequested& stop_requested);

}  // namespace handloft::tracking
