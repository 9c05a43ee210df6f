#pragma once
// Which display a run gets: what its options ask for, as far as this machine has it.

#include "client-hmd/display/display.h"
#include "client-hmd/main/options.h"
#include "common/base/log.h"

namespace handloft::client {

/// A window where there is a display server and nobody asked for less; else offscreen, with lowered priority.
/// Errors: unsupported when not even that can be had.
Result<std::unique_ptr<Display>> open_display(const HmdOptions& options, const Logger& log);

}  // namespace handloft::client
