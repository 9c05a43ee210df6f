#include "client-hmd/main/options.h"

#include <fmt/format.h>

#include <charconv>
#include <string_view>
#include <utility>

namespace handloft::client {
namespace {

template <typename Number>
bool parse_number(std::string_view text, Number& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size();
}

Error bad(std::string_view option, std::string_view found, std::string_view expected) {
  return make_error(ErrorCode::invalid_argument, fmt::format("found '{}', expected {}", found, expected),
                    std::string(option));
}

Result<std::optional<net::Endpoint>> parse_optional(const std::string& text) {
  if (text.empty()) return std::optional<net::Endpoint>();
  Result<net::Endpoint> endpoint = net::parse_endpoint(text);
  if (!endpoint) return endpoint.error();
  return std::optional<net::Endpoint>(std::move(*endpoint));
}

void add_sequence(OptionTable& table, SequenceOptions& shots) {
  table.add("turntable", shots.turntable, "Write pictures once round the scene into a folder, then end",
            {.value_name = "FOLDER"});
  table.add("frames", shots.frames, "Pictures of a turntable", {.min = 1, .max = 100'000, .value_name = "N"});
  table.add("elevation", shots.elevation_deg, "Of a turntable: how far from above, in degrees",
            {.min = -89, .max = 89, .value_name = "DEG"});
  table.add("distance", shots.distance_m, "Of a turntable; 0: as near as all of the scene allows",
            {.min = 0, .max = 100, .value_name = "M"});
  table.add("script", shots.script, "Write pictures along the camera path of a script, then end",
            {.value_name = "FILE.toml"});
  table.add("pictures", shots.pictures, "Where the pictures of --script go", {.value_name = "FOLDER"});
  table.add("overwrite", shots.overwrite, "Let a sequence replace pictures that are there");
  table.add("transparent", shots.transparent, "Pictures of a sequence have a transparent background");
}

Status check_sequence(const HmdOptions& options) {
  const SequenceOptions& shots = options.shots;
  if (!shots.turntable.empty() && !shots.script.empty()) {
    return bad("script", shots.script, "either a turntable or a script");
  }
  if (shots.script.empty() != shots.pictures.empty()) {
    return bad(shots.pictures.empty() ? "pictures" : "script", "none", "--script with --pictures FOLDER");
  }
  if (shots.wanted() && (options.once || !options.screenshot.empty() || !options.report.empty())) {
    return bad(shots.turntable.empty() ? "script" : "turntable", "a screenshot or report too",
               "a sequence alone");
  }
  return {};
}

}  // namespace

Result<std::pair<int, int>> parse_size(const std::string& text) {
  constexpr int smallest = 16;
  constexpr int largest = 8192;
  const std::size_t cross = text.find('x');
  int width = 0;
  int height = 0;
  if (cross == std::string::npos || !parse_number(std::string_view(text).substr(0, cross), width) ||
      !parse_number(std::string_view(text).substr(cross + 1), height) || width < smallest ||
      height < smallest || width > largest || height > largest) {
    return bad("size", text, fmt::format("WIDTHxHEIGHT within {}..{}", smallest, largest));
  }
  return std::pair{width, height};
}

Result<ParsedOptions> parse_options(int argc, const char* const* argv) {
  ParsedOptions parsed;
  HmdOptions& options = parsed.options;
  std::string model, tracking, size = "1280x720", when = "end", camera = "orbit", view = "table",
                               shading = "studio", curvature = "mean", overlay = "none", edges = "soft",
                               surroundings = "workplace", hand_occlusion = "on";
  double duration_s = 0.0;
  double curvature_range_per_m = 0.0;
  double display_latency_ms = 16.0;

  OptionTable table("handloft-hmd", "Shows a Handloft scene: in a window, or offscreen into a picture.");
  table.add("model", model, "The model server; default: this user's own", {.value_name = "ENDPOINT"});
  table.add("tracking", tracking, "The tracking daemon; default: none", {.value_name = "ENDPOINT"});
  table.add("offscreen", options.offscreen, "Draw without a window (also when there is no display)");
  table.add("stereo", options.stereo, "Draw a view for each eye, side by side, as a headset needs it");
  table.add("hmd", options.hmd,
            "What the headset is like (deploy/config/hmd.toml); default: two plain halves",
            {.value_name = "FILE.toml"});
  table.add("monitor", options.monitor, "Cover this monitor, borderless; see --monitors",
            {.value_name = "NAME|N"});
  table.add("monitors", options.monitors, "List the monitors and end");
  table.add("film_depth", options.film_depth_m,
            "With --stereo: how far before its camera the film is taken to be; 0: infinitely far",
            {.min = 0, .max = 100, .value_name = "M"});
  table.add("size", size, "Size of the picture", {.value_name = "WIDTHxHEIGHT"});
  table.add("camera", camera, "Where to look from", {.choices = {"orbit", "head"}});
  table.add("view", view,
            "What the orbiting camera looks at: the table with its palette, or as near as the whole scene "
            "allows (in a window: once; key F)",
            {.choices = {"table", "fit"}});
  table.add("screenshot", options.screenshot, "Write a picture", {.value_name = "FILE.png"});
  table.add("screenshot_when", when, "When: idle (nothing changed for a second), end, or frames:N",
            {.value_name = "WHEN"});
  table.add("distances", options.distances, "Colour shapes by their distances to references");
  table.add("distance_range", options.distance_range_mm, "Distance at the ends of the colours",
            {.min = 0.01, .max = 1000, .value_name = "MM"});
  table.add(
      "shading", shading,
      "How surfaces look: lit as in a studio, or with the mirrored stripes that show how smooth they are "
      "(in a window: key Z)",
      {.choices = {"studio", "clay", "car-paint", "silver", "zebra", "curvature"}});
  table.add("curvature", curvature, "Which curvature --shading curvature shows",
            {.choices = {"mean", "gaussian", "largest", "smallest"}});
  table.add("curvature_range", curvature_range_per_m,
            "Curvature at the ends of the colours; 0: so that 95 % of what is seen lies within",
            {.min = 0, .max = 1e6, .value_name = "1/M"});
  table.add("overlay", overlay, "Lines over surfaces: wires, net, isophotes, or several with commas",
            {.value_name = "LINES"});
  table.add("edges", edges, "Surfaces with their falloff, or cut off where an export is",
            {.choices = {"soft", "trimmed"}});
  table.add("surroundings", surroundings, "The table with grid and palette, or a bare one without words",
            {.choices = {"workplace", "bare"}});
  table.add("azimuth", options.azimuth_deg, "From where the orbiting camera looks at first; 0: from +x",
            {.min = -360, .max = 360, .value_name = "DEG"});
  table.add("camera_elevation", options.camera_elevation_deg,
            "How far from above it looks; 90: straight down", {.min = -89, .max = 89, .value_name = "DEG"});
  table.add("once", options.once, "Take one screenshot of the scene as it is, then end");
  table.add("duration", duration_s, "End after so many seconds; 0: not",
            {.min = 0, .max = 1e6, .value_name = "S"});
  table.add("metrics", options.metrics,
            "Serve metrics in Prometheus' text format: tcp:127.0.0.1:9465 or unix:PATH, GET /metrics",
            {.value_name = "ENDPOINT"});
  table.add("hand_occlusion", hand_occlusion, "Over film: whether the filmed hand hides what is behind it",
            {.choices = {"on", "off"}});
  table.add("stats", options.stats, "Show how old what is seen is, and say it at the end");
  table.add("report", options.report, "Write figures as JSON at the end", {.value_name = "FILE.json"});
  table.add("display_latency", display_latency_ms, "From drawing to light on the display",
            {.min = 0, .max = 200, .value_name = "MS"});
  table.add("frame_rate", options.offscreen_rate_hz, "Frames a second without a window",
            {.min = 0.1, .max = 1000, .value_name = "HZ"});
  table.add("offscreen_scale", options.offscreen_scale,
            "Without a window: size of the frames before the screenshot, as a share of it",
            {.min = 0.1, .max = 1, .value_name = "SHARE"});
  add_sequence(table, options.shots);
  std::string panels = "windows";
  table.add("panels", panels, "Panels over the picture: in windows, always, or never",
            {.choices = {"windows", "always", "never"}});
  table.add("view_only", options.view_only, "In a window: only look; mouse and keys model nothing");
  table.add("pair", options.pair,
            "Pair this device with the model server by the code that `handloft-modeld invite` printed; once");
  table.add("name", options.name, "Of this user, shown to others; default: as the system has it",
            {.value_name = "NAME"});
  table.add("log_level", options.log_level, "How much to say",
            {.choices = {"trace", "debug", "info", "warning", "error", "off"}});
  Result<ParseOutcome> outcome = table.parse(argc, argv);
  if (!outcome) return outcome.error();
  parsed.outcome = std::move(*outcome);
  if (parsed.outcome.action == ParseOutcome::Action::show_text) return parsed;
  if (panels == "always") options.panels = PanelWish::always;
  if (panels == "never") options.panels = PanelWish::never;

  Result<std::optional<net::Endpoint>> model_endpoint = parse_optional(model);
  if (!model_endpoint) return bad("model", model, model_endpoint.error().message);
  options.model = std::move(*model_endpoint);
  Result<std::optional<net::Endpoint>> tracking_endpoint = parse_optional(tracking);
  if (!tracking_endpoint) return bad("tracking", tracking, tracking_endpoint.error().message);
  options.tracking = std::move(*tracking_endpoint);

  const Result<std::pair<int, int>> pixels = parse_size(size);
  if (!pixels) return pixels.error();
  std::tie(options.width_px, options.height_px) = *pixels;
  options.camera = camera == "head" ? CameraMode::head : CameraMode::orbit;
  options.view = view == "fit" ? ViewChoice::fit : ViewChoice::table;
  options.shading = shading_named(shading).value_or(Shading::studio);
  options.curvature.kind = curvature_kind_named(curvature).value_or(CurvatureKind::mean);
  options.curvature.range_per_m = static_cast<float>(curvature_range_per_m);
  const std::optional<SurfaceOverlays> overlays = overlays_named(overlay);
  if (!overlays) return bad("overlay", overlay, "none, wires, net or isophotes, with commas between");
  options.overlays = *overlays;
  options.hand_occlusion = hand_occlusion == "off" ? HandOcclusion::off : HandOcclusion::on;
  options.edges = edges == "trimmed" ? SurfaceEdges::trimmed : SurfaceEdges::soft;
  options.surroundings = surroundings == "bare" ? Surroundings::bare : Surroundings::workplace;
  options.duration = from_seconds(duration_s);
  options.display_latency = from_seconds(display_latency_ms / 1e3);

  constexpr std::string_view frames = "frames:";
  if (when == "idle") {
    options.screenshot_time = ScreenshotTime::idle;
  } else if (when == "end") {
    options.screenshot_time = ScreenshotTime::end;
  } else if (when.starts_with(frames) &&
             parse_number(std::string_view(when).substr(frames.size()), options.screenshot_frames) &&
             options.screenshot_frames > 0) {
    options.screenshot_time = ScreenshotTime::frames;
  } else {
    return bad("screenshot_when", when, "idle, end or frames:N");
  }
  if (options.once && options.screenshot.empty()) {
    return bad("once", "no screenshot", "a file to write: --screenshot FILE.png");
  }
  if (const Status sequence = check_sequence(options); !sequence) return sequence.error();
  if (options.shots.wanted()) options.offscreen = true;
  return parsed;
}

}  // namespace handloft::client
