#pragma once
// Which picture format, size and rate to ask a camera for (tracking.md 5.4): the frame rate first, because
// the age of a frame costs more accuracy than its resolution gives; then the resolution; MJPEG where YUYV
// doesn't fit through the bus. Pure functions: the lists come from v4l2_enumerate.h.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

/// No webcam's picture is larger; what a driver names beyond it is not believed.
inline constexpr int largest_side_px = 16384;

/// One size of one format with the rates that the driver names for it, fastest first.
struct VideoSize {
  PixelFormat format = PixelFormat::mjpeg;
  int width_px = 0;
  int height_px = 0;
  std::vector<double> rates_hz;
};

struct VideoMode {
  PixelFormat format = PixelFormat::mjpeg;
  int width_px = 0;
  int height_px = 0;
  double rate_hz = 0;
};

struct ModeWish {
  double rate_hz = 30.0;
  int width_px = 640;
  int height_px = 480;
  /// Nothing else is taken when given: a calibration belongs to one mode (T2).
  std::optional<PixelFormat> format;
  /// What the bus gives this camera. USB 2 carries 24.5 MB/s for one isochronous endpoint (3 x 1024 bytes,
  /// 8000 times a second).
  double bandwidth_bytes_per_s = 24.5e6;
};

/// Bytes a second on the bus. MJPEG is taken at 2 bits a pixel, a busy picture at good quality.
double bandwidth_bytes_per_s(const VideoMode& mode);

/// All modes worth trying, best first: after the first is refused for bandwidth (ENOSPC) the next that needs
/// less is tried. Within 5 % of the wanted rate counts as reached; then nearest size, then raw before
/// MJPEG as far as it fits, and grey only where asked for or nothing else is there (no colours: tags only).
std::vector<VideoMode> rank_modes(const std::vector<VideoSize>& sizes, const ModeWish& wish);

/// The first of rank_modes(). Errors: not_found, naming what there is.
Result<VideoMode> choose_mode(const std::vector<VideoSize>& sizes, const ModeWish& wish);

/// What to try after `refused` had no room on the bus: the best of `ranked` that needs less, of the same size
/// as long as there is one (a calibration belongs to a size). Nullopt when nothing needs less.
std::optional<VideoMode> smaller_mode(const std::vector<VideoMode>& ranked, const VideoMode& refused);

/// What several cameras on one bus may ask for together.
struct BusShare {
  std::string bus;               ///< "usb1"
  double speed_mbit_s = 480;     ///< Of the bus.
  std::vector<VideoMode> modes;  ///< One a camera on it.
};
/// Empty when the modes fit together; else in words, with a proposal.
std::string bus_problem(const BusShare& share);

/// "640x480 at 30 Hz MJPEG"
std::string to_string(const VideoMode& mode);
std::string_view to_string(PixelFormat format);

}  // namespace handloft::tracking
