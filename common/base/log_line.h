#pragma once
// How a line of the log is written: for people, or as one JSON object for programs that collect logs. A
// logger's name carries what is known of its lines: the component, then "key=value" fields such as the client
// and the model.

#include <spdlog/formatter.h>

#include <memory>
#include <string>
#include <string_view>

namespace handloft {

enum class LogFormat {
  text,  ///< 2026-01-31 12:00:00.123 info    [net client=7] message
  json,  ///< {"time":"2026-01-31T12:00:00.123Z","level":"info","component":"net","client":"7","message":"..."}
};

/// Between the component and the fields of a logger's name.
inline constexpr char log_field_separator = '\x1f';

/// A formatter that writes lines so. What is no UTF-8, and control characters, are replaced in JSON.
std::unique_ptr<spdlog::formatter> make_log_formatter(LogFormat format);

/// In quotes, as a JSON string.
std::string json_text(std::string_view text);

}  // namespace handloft
