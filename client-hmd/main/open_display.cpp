#include "client-hmd/main/open_display.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>

#include "client-hmd/display/offscreen_display.h"
#include "client-hmd/display/window_display.h"

namespace handloft::client {
namespace {

constexpr int offscreen_niceness = 10;  ///< Drawing in software yields to tracking and modelling.

}  // namespace

Result<std::unique_ptr<Display>> open_display(const HmdOptions& options, const Logger& log) {
  const bool server = std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
  if (!options.offscreen && !options.once && server) {
    Result<std::unique_ptr<Display>> window = WindowDisplay::open(options.width_px, options.height_px);
    if (window) return window;
    log.warning("no window, so drawing offscreen: {}", window.error().describe());
  }
  // Threads that a software driver starts inherit this, those of the network run already.
  if (setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), offscreen_niceness) != 0) {
    log.warning("cannot lower the priority of drawing");
  }
  return OffscreenDisplay::open(options.width_px, options.height_px);
}

}  // namespace handloft::client
