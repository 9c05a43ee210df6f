#pragma once
// Runs a script (proto/SCRIPT.md): one JSON object a line, each answered with exactly one line of JSON (U7).

#include <cstddef>
#include <iosfwd>
#include <string>

#include "server-model/session/script_target.h"

namespace handloft::model {

struct ScriptOptions {
  enum class OnFailure { stop, keep_going };
  OnFailure on_failure = OnFailure::stop;   ///< What follows a failed line is seldom what was meant.
  std::size_t max_line_bytes = 256U << 20;  ///< A million points take about 100 MB of JSON.
};

struct ScriptSummary {
  std::size_t lines_run = 0;  ///< Without blank lines and comments.
  std::size_t lines_failed = 0;
  std::size_t first_failed_line = 0;  ///< From 1; 0: none.
  std::string first_failure;          ///< In words.
  bool ok() const { return lines_failed == 0; }
};

/// Reads lines from `in`, writes one answer line each to `out` and flushes it. Never throws; a malformed line
/// is a failed line.
ScriptSummary run_script(std::istream& in, std::ostream& out, ScriptTarget& target,
                         const ScriptOptions& options = {});

}  // namespace handloft::model
