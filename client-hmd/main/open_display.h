#pragma once
// Which display a run gets: what its options ask for, as far as this machine has it.

#include "client-hmd/display/display.h"
#include "client-hmd/main/options.h"
#include "common/base/log.h"

namespace handloft::client {

/// A window, or the whole of a monitor, where there is a display server and nobody asked for less; else
/// offscreen, with lowered priority. With two views if asked for. Errors: unsupported when not even that can
/// be had; those of read_hmd_calibration().
Result<std::unique_ptr<Display>> open_display(const HmdOptions& options, const Logger& log);

}  // namespace handloft::client
