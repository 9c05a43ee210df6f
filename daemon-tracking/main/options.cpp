#include "daemon-tracking/main/options.h"

#include <cstdlib>
#include <string>

#include "daemon-tracking/main/exit_status.h"

namespace handloft::tracking {

namespace {
constexpr double slowest_replay = 0.1;
}  // namespace

OptionTable make_option_table(DaemonOptions& options) {
  OptionTable table("handloft-trackd",
                    "Tracks head and hand with cameras and a glove, and publishes poses and gestures.\n" +
                        std::string(exit_status_words));
  table.add_positional(
      "COMMAND", options.command,
      "run (what happens without one): follow the devices of this computer; record FILE: the "
      "same, and record; replay FILE; devices: what is plugged in; status: what a running "
      "daemon says of its devices; doctor: what is missing or set wrongly, and the remedy",
      OptionTable::Presence::optional,
      {.choices = {"run", "record", "replay", "devices", "status", "doctor"}});
  table.add_positional("FILE", options.file, "The recording", OptionTable::Presence::optional);
  table.add("listen", options.listen, "Where subscribers connect; default: this user's runtime folder",
            {.value_name = "ENDPOINT"});
  table.add(
      "simulate", options.simulate,
      "A simulated rig: a hand that designs a mouse shell, does all that hands can do, sculpts, follows "
      "strokes or a recorded hand",
      {.choices = {"mouse", "tour", "sculpt", "strokes", "motion"}});
  table.add("strokes", options.strokes, "The strokes that the simulated hand follows",
            {.value_name = "FILE.tilt"});
  table.add("motion", options.motion, "The recorded fingertips that the simulated hand follows",
            {.value_name = "FILE.tsv"});
  table.add("motion_s", options.motion_s, "No more of the motion than so many seconds",
            {.min = 1, .max = 3600});
  table.add("calibration", options.calibration,
            "What handloft-calibrate wrote; default: handloft/calibration.toml in this user's configuration. "
            "A recording brings its own",
            {.value_name = "FILE.toml"});
  table.add("cameras", options.cameras, "Follow the cameras; without them no calibration is needed");
  table.add(
      "serial_glove", options.serial_glove,
      "Follow a LucidGloves-compatible glove on this line instead of one over USB HID: /dev/ttyUSB0, or "
      "serial=SERIAL of its adapter",
      {.value_name = "LINE"});
  table.add("replay", options.replay, "Play a recording through the same code", {.value_name = "FILE"});
  table.add("speed", options.speed, "Of a replay: 1 as it was, 2 twice as fast; 0: as fast as it goes",
            {.min = 0, .max = 100, .value_name = "X"});
  table.add("repeat", options.repeat, "Replay so many times over", {.min = 1, .max = 100000});
  table.add("record", options.record, "Record all that the devices say", {.value_name = "FILE"});
  table.add("metrics", options.metrics,
            "Serve metrics in Prometheus' text format: tcp:127.0.0.1:9464 or unix:PATH, GET /metrics",
            {.value_name = "ENDPOINT"});
  table.add("trace", options.trace,
            "Write the newest 100,000 spans of the stages at the end, for chrome://tracing or "
            "ui.perfetto.dev",
            {.value_name = "FILE.json"});
  table.add("report", options.report, "Write figures on the session as JSON when it ends",
            {.value_name = "FILE"});
  table.add("pace", options.pace, "How fast samples come: simulations by default in real time, replays fast",
            {.choices = {"default", "real-time", "fast"}});
  table.add("seed", options.seed, "Of the simulated rig's noise and timing");
  table.add("camera_rate_hz", options.camera_rate_hz, "Frames a second of the simulated cameras",
            {.min = 5, .max = 120});
  table.add("wait_for_subscribers", options.wait_for_subscribers, "Begin when so many have subscribed",
            {.min = 0, .max = 64});
  table.add("wait_timeout_s", options.wait_timeout_s, "But give up after this many seconds",
            {.min = 0, .max = 3600});
  table.add("exit_at_end", options.exit_at_end, "End when the simulation or the recording does");
  table.add("video", options.video, "Offer the cameras' pictures to viewers in shared memory");
  table.add("json", options.json, "devices, status and doctor answer in JSON");
  table.add("log_level", options.log_level, "What is logged on standard error",
            {.choices = {"trace", "debug", "info", "warning", "error", "off"}});
  return table;
}

Status resolve_command(DaemonOptions& options) {
  const bool takes_file = options.command == "record" || options.command == "replay";
  if (takes_file && options.file.empty())
    return make_error(ErrorCode::invalid_argument, "expected a file: " + options.command + " FILE", "FILE");
  if (!takes_file && !options.file.empty()) {
    return make_error(ErrorCode::invalid_argument,
                      "found \"" + options.file + "\", expected nothing after " + options.command, "FILE");
  }
  if (!takes_file) return {};
  std::optional<std::string>& target = options.command == "record" ? options.record : options.replay;
  if (target) {
    return make_error(ErrorCode::invalid_argument, "found twice, as a flag and after " + options.command,
                      options.command);
  }
  target = options.file;
  return {};
}

bool uses_devices(const DaemonOptions& options) {
  return !options.simulate && !options.replay;
}

Result<std::string> default_calibration_path() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  if (config != nullptr && config[0] == '/') return std::string(config) + "/handloft/calibration.toml";
  if (home != nullptr && home[0] == '/') return std::string(home) + "/.config/handloft/calibration.toml";
  return make_error(ErrorCode::not_found, "neither XDG_CONFIG_HOME nor HOME is set", "calibration");
}

Status check(const DaemonOptions& options) {
  const auto refuse = [](const char* field, const char* message) {
    return make_error(ErrorCode::invalid_argument, message, field);
  };
  if (options.simulate && options.replay)
    return refuse("replay", "found together with --simulate, expected one of them");
  if (options.strokes && options.simulate != "strokes")
    return refuse("strokes", "expected only with --simulate strokes");
  if (options.simulate == "strokes" && !options.strokes)
    return refuse("strokes", "--simulate strokes needs a .tilt file");
  if (options.motion && options.simulate != "motion")
    return refuse("motion", "expected only with --simulate motion");
  if (options.simulate == "motion" && !options.motion)
    return refuse("motion", "--simulate motion needs a motion capture's .tsv file");
  if (options.simulate && options.calibration)
    return refuse("calibration", "found together with --simulate, whose rig is as it is");
  if (!options.replay && (options.speed > 0.0 || options.repeat > 1))
    return refuse(options.speed > 0.0 ? "speed" : "repeat", "expected only with a replay");
  if (options.speed > 0.0 && options.speed < slowest_replay)
    return refuse("speed", "expected 0.1 to 100, or 0 for as fast as it goes");
  if (options.speed > 0.0 && options.pace != "default")
    return refuse("pace", "found together with --speed, expected one of them");
  if (uses_devices(options) && options.pace == "fast")
    return refuse("pace", "devices come in real time; fast is for simulations and replays");
  if (options.record && options.record == options.replay) {
    return refuse("record", "found the file that is being replayed, expected another one");
  }
  return {};
}

}  // namespace handloft::tracking
