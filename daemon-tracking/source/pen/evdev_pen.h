#pragma once
// A real pen tablet over the kernel's input events, by libevdev (tracking.md 5.9): events with the kernel's
// times on CLOCK_MONOTONIC (T4), everything known again after the kernel dropped events (SYN_DROPPED), and
// what the pen does already when the tablet is opened. When a pen is unplugged, or another program grabs it,
// it is reported absent and opened again when it can be (T3).

#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "daemon-tracking/source/hotplug.h"
#include "daemon-tracking/source/pen/pen_source.h"

namespace handloft::tracking {

enum class PenGrab : std::uint8_t {
  shared,     ///< The desktop's pointer moves too.
  exclusive,  ///< Nobody else gets the pen's events (EVIOCGRAB).
};

struct EvdevPenOptions {
  std::string serial;  ///< Of the one that is meant; empty: the first tablet with a pen.
  PenGrab grab = PenGrab::shared;
};

/// `hotplug` must watch "input"; it and `clock` (CLOCK_MONOTONIC, for the kernel's times to mean anything)
/// must outlive the source. start() succeeds without a tablet too.
std::unique_ptr<PenSource> make_evdev_pen(const EvdevPenOptions& options, HotplugMonitor& hotplug,
                                          const Clock& clock, Logger log);

}  // namespace handloft::tracking
