#pragma once
// The options of handloft-trackd: its command and that one's file, flags, and keys of its TOML file.

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/config.h"

namespace handloft::tracking {

struct DaemonOptions {
  std::string command = "run";              ///< "run", "record", "replay", "devices", "status" or "doctor"
  std::string file;                         ///< Of `record` and `replay`.
  std::string listen;                       ///< Empty: the default endpoint of this user.
  std::optional<std::string> simulate;      ///< "mouse", "tour", "sculpt", "strokes" or "motion"
  std::optional<std::string> strokes;       ///< A .tilt file, for simulate = strokes.
  std::optional<std::string> motion;        ///< A motion capture, for simulate = motion.
  double motion_s = 3600.0;                 ///< How much of it.
  std::optional<std::string> calibration;   ///< Empty: default_calibration_path().
  bool cameras = true;                      ///< Real devices: no cameras and no calibration when false.
  std::optional<std::string> serial_glove;  ///< The line of a LucidGloves-compatible glove.
  std::optional<std::string> replay;        ///< A recording.
  double speed = 0.0;                       ///< Of a replay, 1 being as it was; 0: as fast as it goes.
  std::uint64_t repeat = 1;                 ///< How many times over a recording is replayed.
  std::optional<std::string> record;        ///< Where to write one.
  std::optional<std::string> metrics;       ///< Where to serve metrics over HTTP.
  std::optional<std::string> trace;         ///< Where to write what each stage did when, at the end.
  std::optional<std::string> report;        ///< Where to write the figures at the end, as JSON.
  std::string pace = "default";  ///< "real-time", "fast"; default: real-time simulation, fast replay.
  std::uint64_t seed = 1;
  double camera_rate_hz = 30.0;
  std::uint64_t wait_for_subscribers = 0;
  double wait_timeout_s = 60.0;
  bool exit_at_end = false;
  bool video = true;  ///< Offer the cameras' pictures in shared memory.
  bool json = false;  ///< `devices`, `status` and `doctor` answer for programs.
  std::string log_level = "info";
};

/// The table over `options`, which must outlive it.
OptionTable make_option_table(DaemonOptions& options);

/// Where the words of the command line stand for flags: `record FILE`, `replay FILE`. Errors:
/// invalid_argument for a file too many or none.
Status resolve_command(DaemonOptions& options);

/// Whether the samples come from devices of this computer.
bool uses_devices(const DaemonOptions& options);

/// $XDG_CONFIG_HOME/handloft/calibration.toml, or below ~/.config without that variable. Errors: not_found
/// when neither it nor HOME is set.
Result<std::string> default_calibration_path();

/// What the table can't say of single options: not two sources, strokes only with its simulation.
Status check(const DaemonOptions& options);

}  // namespace handloft::tracking
