#pragma once
// A LucidGloves-compatible glove on a serial line, as a second, existing glove behind the same interface.
// Nothing on a serial line says what is at its other end, and opening one restarts many boards, so only the
// line that the configuration names is ever opened.
//
// It delivers DevicePresence "glove" and every line as DeviceBytes of kind serial_glove_line; what the values
// mean is decided behind the recording (fusion/serial_glove_mapper.h).

#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "daemon-tracking/source/glove/glove_source.h"
#include "daemon-tracking/source/hotplug.h"

namespace handloft::tracking {

struct SerialGloveOptions {
  /// "/dev/ttyUSB0", a link under /dev/serial/by-id, or "serial=SERIAL" of its USB adapter.
  std::string line;
  /// The firmware sends some 100 to 1000 lines a second; a board needs up to 2 s to restart after opening.
  Duration silent_after = std::chrono::seconds(3);
};

/// `hotplug` must watch "tty"; it and `clock` must outlive the source. start() succeeds without a glove too;
/// errors: invalid_argument when no line is named.
std::unique_ptr<GloveSource> make_serial_glove(const SerialGloveOptions& options, HotplugMonitor& hotplug,
                                               const Clock& clock, Logger log);

}  // namespace handloft::tracking
