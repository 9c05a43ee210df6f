#pragma once
// The options of handloft-trackd: flags, and keys of its TOML file.

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/config.h"

namespace handloft::tracking {

struct DaemonOptions {
  std::string listen;                   ///< Empty: the default endpoint of this user.
  std::optional<std::string> simulate;  ///< "mouse", "tour", "sculpt", "strokes" or "motion"
  std::optional<std::string> strokes;   ///< A .tilt file, for simulate = strokes.
  std::optional<std::string> motion;    ///< A motion capture, for simulate = motion.
  double motion_s = 3600.0;             ///< How much of it.
  std::optional<std::string> replay;    ///< A recording.
  std::optional<std::string> record;    ///< Where to write one.
  std::optional<std::string> report;    ///< Where to write the figures at the end, as JSON.
  std::string pace = "default";         ///< "real-time", "fast"; default: real-time simulation, fast replay.
  std::uint64_t seed = 1;
  double camera_rate_hz = 30.0;
  std::uint64_t wait_for_subscribers = 0;
  double wait_timeout_s = 60.0;
  bool exit_at_end = false;
  bool video = true;  ///< Offer the cameras' pictures in shared memory.
  std::string log_level = "info";
};

/// The table over `options`, which must outlive it.
OptionTable make_option_table(DaemonOptions& options);

/// What the table can't say of single options: exactly one source, strokes only with its simulation.
Status check(const DaemonOptions& options);

}  // namespace handloft::tracking
