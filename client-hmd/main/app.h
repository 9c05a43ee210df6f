#pragma once
// The frame loop: takes the newest of everything, draws it, and never waits for anybody (V5).

#include "client-hmd/main/options.h"
#include "common/base/log.h"

namespace handloft::client {

/// Runs until it is told to end (SIGTERM, SIGINT, the window, --duration, --once); then writes screenshot and
/// report. Must be called before any other thread starts, since it blocks those signals for all of them.
/// Errors: what keeps it from drawing at all, or from writing what it was asked to write.
Status run_hmd(const HmdOptions& options, const Logger& log);

}  // namespace handloft::client
