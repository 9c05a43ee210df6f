#pragma once
// How handloft-trackd ends; said by --help too.

#include <string_view>

namespace handloft::tracking {

enum ExitStatus : int {
  exit_ok =
      0,  ///< The source ended, or a signal did. So does a recording that is cut off: all of it was played.
  /// It could not start; or it could, and did all that was possible, but the recording that was replayed is
  /// damaged, the one that was written is not whole, or the report could not be written.
  exit_failed = 1,
  exit_usage = 2,  ///< The command line or a configuration file is wrong.
};

inline constexpr std::string_view exit_status_words =
    "Exit status: 0 the source ended or was told to end, also where a recording is cut off as after a crash\n"
    "(a warning says so); 1 it could not start, the recording that it replayed is damaged (what comes "
    "before\n"
    "was played), the one that it wrote is not whole, or the report was not written; 2 wrong usage, or a\n"
    "configuration or calibration that is wrong or missing.";

}  // namespace handloft::tracking
