#include "common/base/log.h"

#include <spdlog/sinks/stdout_sinks.h>

#include <array>

namespace handloft {

namespace {

struct NamedLevel {
  LogLevel level;
  std::string_view name;
};
constexpr std::array<NamedLevel, 6> levels{{{LogLevel::trace, "trace"},
                                            {LogLevel::debug, "debug"},
                                            {LogLevel::info, "info"},
                                            {LogLevel::warning, "warning"},
                                            {LogLevel::error, "error"},
                                            {LogLevel::off, "off"}}};

spdlog::level::level_enum to_spdlog(LogLevel level) {
  switch (level) {
    case LogLevel::trace:
      return spdlog::level::trace;
    case LogLevel::debug:
      return spdlog::level::debug;
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warning:
      return spdlog::level::warn;
    case LogLevel::error:
      return spdlog::level::err;
    case LogLevel::off:
      return spdlog::level::off;
  }
  return spdlog::level::info;
}

}  // namespace

Result<LogLevel> parse_log_level(std::string_view text) {
  for (const NamedLevel& candidate : levels) {
    if (candidate.name == text) return candidate.level;
  }
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found \"{}\", expected trace, debug, info, warning, error or off", text),
                    "log_level");
}

std::string_view to_string(LogLevel level) {
  for (const NamedLevel& candidate : levels) {
    if (candidate.level == level) return candidate.name;
  }
  return "info";
}

Result<LogFormat> parse_log_format(std::string_view text) {
  if (text == "text") return LogFormat::text;
  if (text == "json") return LogFormat::json;
  return make_error(ErrorCode::invalid_argument, fmt::format("found \"{}\", expected text or json", text),
                    "log_format");
}

Logger::Logger(std::string component, LogLevel level, LogFormat format)
    : Logger(std::move(component), level, std::make_shared<spdlog::sinks::stderr_sink_mt>(), format) {}

Logger::Logger(std::string component, LogLevel level, spdlog::sink_ptr sink, LogFormat format)
    : logger_(std::make_shared<spdlog::logger>(std::move(component), std::move(sink))) {
  logger_->set_formatter(make_log_formatter(format));
  logger_->flush_on(spdlog::level::trace);
  // The sink has the level, since it is the same one for every component and every copy.
  logger_->set_level(spdlog::level::trace);
  set_level(level);
}

Logger Logger::component(std::string name) const {
  const std::string& own = logger_->name();
  const std::size_t fields = own.find(log_field_separator);
  if (fields != std::string::npos) name += own.substr(fields);
  return Logger(logger_->clone(std::move(name)));
}

Logger Logger::with(std::string_view key, std::string_view value) const {
  std::string field = fmt::format("{}={}", key, value);
  std::erase(field, log_field_separator);
  return Logger(logger_->clone(logger_->name() + log_field_separator + field));
}

void Logger::set_level(LogLevel level) {
  for (const spdlog::sink_ptr& sink : logger_->sinks()) sink->set_level(to_spdlog(level));
}

std::optional<std::uint64_t> RateLimit::allow(TimePoint now) {
  const std::lock_guard lock(mutex_);
  if (last_ && now - *last_ < interval_) {
    ++suppressed_;
    return std::nullopt;
  }
  last_ = now;
  return std::exchange(suppressed_, 0);
}

}  // namespace handloft
