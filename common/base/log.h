#pragma once
// Logging for people and for bug reports: one line a message on standard error, never standard output (which
// belongs to what a program answers). Each component has its own Logger, handed on by value; there is no
// global one.

#include <spdlog/logger.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/clock.h"
#include "common/base/log_line.h"
#include "common/base/result.h"

namespace handloft {

enum class LogLevel { trace, debug, info, warning, error, off };

/// "trace", "debug", "info", "warning", "error", "off"; anything else is refused, naming the choices.
Result<LogLevel> parse_log_level(std::string_view text);
std::string_view to_string(LogLevel level);
/// "text", "json"; anything else is refused, naming the choices.
Result<LogFormat> parse_log_format(std::string_view text);

/// A component's voice. Copies share one sink and one level. Thread-safe.
class Logger {
 public:
  /// Writes "2026-01-31 12:00:00.123 info    [component] message" to standard error, or the same as JSON.
  explicit Logger(std::string component, LogLevel level = LogLevel::info, LogFormat format = LogFormat::text);
  /// A logger that writes to `sink` instead: for tests.
  Logger(std::string component, LogLevel level, spdlog::sink_ptr sink, LogFormat format = LogFormat::text);

  /// A logger of another component with the same sink, fields and level, also when that changes.
  Logger component(std::string name) const;
  /// A logger whose lines also say this, as "model" or "client" of what they are about. Separators in the
  /// texts are left out.
  Logger with(std::string_view key, std::string_view value) const;
  void set_level(LogLevel level);

  template <typename... Args>
  void debug(fmt::format_string<Args...> format, Args&&... args) const {
    logger_->log(spdlog::level::debug, format, std::forward<Args>(args)...);
  }
  template <typename... Args>
  void info(fmt::format_string<Args...> format, Args&&... args) const {
    logger_->log(spdlog::level::info, format, std::forward<Args>(args)...);
  }
  template <typename... Args>
  void warning(fmt::format_string<Args...> format, Args&&... args) const {
    logger_->log(spdlog::level::warn, format, std::forward<Args>(args)...);
  }
  template <typename... Args>
  void error(fmt::format_string<Args...> format, Args&&... args) const {
    logger_->log(spdlog::level::err, format, std::forward<Args>(args)...);
  }

 private:
  explicit Logger(std::shared_ptr<spdlog::logger> logger) : logger_(std::move(logger)) {}
  std::shared_ptr<spdlog::logger> logger_;
};

/// Keeps a message that may come with every frame from filling the log: at most one in `interval`.
/// Thread-safe.
class RateLimit {
 public:
  explicit RateLimit(Duration interval) : interval_(interval) {}
  /// nullopt: keep quiet. Otherwise speak, and say how many were kept back since the last time.
  std::optional<std::uint64_t> allow(TimePoint now);

 private:
  Duration interval_;
  std::mutex mutex_;
  std::optional<TimePoint> last_;
  std::uint64_t suppressed_ = 0;
};

}  // namespace handloft
