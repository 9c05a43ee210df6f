#include "client-hmd/main/open_display.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>

#include "client-hmd/display/offscreen_display.h"
#include "client-hmd/display/stereo_display.h"
#include "client-hmd/display/window_display.h"

namespace handloft::client {
namespace {

constexpr int offscreen_niceness = 10;  ///< Drawing in software yields to tracking and modelling.

Result<std::unique_ptr<Display>> open_canvas(const HmdOptions& options, const Logger& log) {
  const bool server = std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
  if (!options.offscreen && !options.once && server) {
    Result<std::unique_ptr<Display>> window =
        WindowDisplay::open({options.width_px, options.height_px, options.monitor}, log.component("display"));
    if (window) return window;
    log.warning("no window, so drawing offscreen: {}", window.error().describe());
  }
  // Threads that a software driver starts inherit this, those of the network run already.
  if (setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), offscreen_niceness) != 0) {
    log.warning("cannot lower the priority of drawing");
  }
  return OffscreenDisplay::open(options.width_px, options.height_px);
}

}  // namespace

Result<std::unique_ptr<Display>> open_display(const HmdOptions& options, const Logger& log) {
  HmdCalibration calibration = default_hmd_calibration();
  if (options.stereo && !options.hmd.empty()) {
    Result<HmdCalibration> read = read_hmd_calibration(options.hmd);
    if (!read) return read.error();
    calibration = std::move(*read);
  }
  Result<std::unique_ptr<Display>> canvas = open_canvas(options, log);
  if (!canvas || !options.stereo) return canvas;
  return std::unique_ptr<Display>(
      std::make_unique<StereoDisplay>(std::move(*canvas), std::move(calibration)));
}

}  // namespace handloft::client
