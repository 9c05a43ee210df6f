#pragma once
// What handloft-hmd is asked to do: the one table behind its flags, its configuration file and its --help.

#include <cstdint>
#include <optional>
#include <string>

#include "client-hmd/render/frame.h"
#include "client-hmd/view/orbit_camera.h"
#include "common/base/clock.h"
#include "common/base/config.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"

namespace handloft::client {

enum class CameraMode { orbit, head };

/// From where the orbiting camera looks at first, and all the time without a window.
enum class ViewChoice {
  table,  ///< At the work and the palette about it.
  fit,    ///< The same direction, as near as the whole scene allows.
};

/// When the screenshot is taken. Without a window, `idle` and `frames` end the program when it is.
enum class ScreenshotTime { idle, end, frames };

/// Whether panels lie over the picture (V7).
enum class PanelWish { in_windows, always, never };

/// A sequence of pictures instead of a run (V8): round the scene, or along a script's path.
struct SequenceOptions {
  std::string turntable;  ///< Folder for the pictures of a turntable; empty: none.
  std::string script;     ///< Path of a script (shots/shot_script.h); empty: none.
  std::string pictures;   ///< Folder for the script's pictures.
  int frames = 120;       ///< Of a turntable: four seconds at 30 a second.
  double elevation_deg = 25.0;
  double distance_m = 0.0;  ///< 0: as near as all of the scene allows.
  bool overwrite = false;
  bool transparent = false;

  bool wanted() const { return !turntable.empty() || !script.empty(); }
};

struct HmdOptions {
  std::optional<net::Endpoint> model;     ///< Absent: the default endpoint.
  std::optional<net::Endpoint> tracking;  ///< Absent: no tracking.
  bool offscreen = false;
  bool stereo = false;                 ///< A view for each eye, side by side.
  std::string hmd;                     ///< Path of a headset's calibration; empty: two plain halves.
  std::optional<std::string> monitor;  ///< Name or number of the one to cover; absent: a window.
  bool monitors = false;               ///< List them, and end.
  double film_depth_m = 0.5;           ///< Where the film is taken to be for two eyes; 0: infinitely far.
  int width_px = 1280;
  int height_px = 720;
  std::string screenshot;  ///< Path of a PNG; empty: none.
  ScreenshotTime screenshot_time = ScreenshotTime::end;
  std::uint64_t screenshot_frames = 0;
  bool stats = false;                  ///< Show how old what is seen is, and say it at the end.
  std::optional<std::string> metrics;  ///< Endpoint to serve them at; absent: none.
  HandOcclusion hand_occlusion = HandOcclusion::on;
  std::string report;   ///< Path of a JSON file; empty: none.
  bool once = false;    ///< One picture of the scene as it is, then end.
  Duration duration{};  ///< Zero: until it is told to end.
  CameraMode camera = CameraMode::orbit;
  ViewChoice view = ViewChoice::table;
  Duration display_latency = std::chrono::milliseconds(16);  ///< From drawing to light: one refresh at 60 Hz.
  double offscreen_rate_hz =
      12.0;  ///< Drawing in software must leave the processor to tracking and modelling.
  double offscreen_scale =
      0.5;                 ///< Size of frames that nobody sees, against that of the screenshot; same reason.
  bool distances = false;  ///< Show shapes' distances to references from the beginning (A28).
  double distance_range_mm = 5.0;     ///< At the ends of their colours; as DistanceScale's.
  Shading shading = Shading::studio;  ///< At first; in a window, key Z changes it.
  CurvatureView curvature;            ///< Shown when `shading` does.
  SurfaceOverlays overlays;           ///< At first.
  SurfaceEdges edges = SurfaceEdges::soft;
  Surroundings surroundings = Surroundings::workplace;
  double azimuth_deg = glm::degrees(OrbitCamera().azimuth_rad);  ///< Of the orbiting camera at first.
  double camera_elevation_deg = glm::degrees(OrbitCamera().elevation_rad);
  SequenceOptions shots;
  PanelWish panels = PanelWish::in_windows;
  bool view_only = false;  ///< In a window: no hand, and nothing can be changed (V6).
  std::string pair;        ///< One-time code of an invitation (U2); empty: paired already, or on this host.
  std::string name;        ///< Shown to others; empty: the user's.
  std::string log_level = "info";
};

struct ParsedOptions {
  ParseOutcome outcome;
  HmdOptions options;
};

/// Errors: invalid_argument naming the option.
Result<ParsedOptions> parse_options(int argc, const char* const* argv);

/// "1280x720". Errors: invalid_argument for anything but WIDTHxHEIGHT within 16..8192.
Result<std::pair<int, int>> parse_size(const std::string& text);

}  // namespace handloft::client
