#include "common/base/log_line.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

namespace handloft {

namespace {

std::vector<std::string_view> parts_of(std::string_view name) {
  std::vector<std::string_view> parts;
  for (std::size_t end = name.find(log_field_separator); end != std::string_view::npos;
       end = name.find(log_field_separator)) {
    parts.push_back(name.substr(0, end));
    name.remove_prefix(end + 1);
  }
  parts.push_back(name);
  return parts;
}

class LineFormatter final : public spdlog::formatter {
 public:
  explicit LineFormatter(LogFormat format) : format_(format) {}

  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& to) override {
    const auto milliseconds =
        std::chrono::duration_cast<std::chrono::milliseconds>(message.time.time_since_epoch()).count();
    constexpr std::int64_t per_second = 1000;
    const auto seconds = static_cast<std::time_t>(milliseconds / per_second);
    std::tm calendar{};
    const std::string_view name(message.logger_name.data(), message.logger_name.size());
    const std::string_view text(message.payload.data(), message.payload.size());
    const auto level_name = spdlog::level::to_string_view(message.level);
    const std::string_view level(level_name.data(), level_name.size());
    auto out = std::back_inserter(to);
    if (format_ == LogFormat::text) {
      localtime_r(&seconds, &calendar);
      out = fmt::format_to(out, "{:%Y-%m-%d %H:%M:%S}.{:03} {:<7} [", calendar, milliseconds % per_second,
                           level);
      for (const char c : name) to.push_back(c == log_field_separator ? ' ' : c);
      fmt::format_to(out, "] {}\n", text);
      return;
    }
    gmtime_r(&seconds, &calendar);
    const auto parts = parts_of(name);
    out = fmt::format_to(out, R"({{"time":"{:%Y-%m-%dT%H:%M:%S}.{:03}Z","level":"{}","component":{})",
                         calendar, milliseconds % per_second, level, json_text(parts.front()));
    for (std::size_t i = 1; i < parts.size(); ++i) {
      const std::size_t end = parts[i].find('=');
      if (end == std::string_view::npos) continue;
      out = fmt::format_to(out, ",{}:{}", json_text(parts[i].substr(0, end)),
                           json_text(parts[i].substr(end + 1)));
    }
    fmt::format_to(out, ",\"message\":{}}}\n", json_text(text));
  }

  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<LineFormatter>(format_);
  }

 private:
  LogFormat format_;
};

}  // namespace

std::unique_ptr<spdlog::formatter> make_log_formatter(LogFormat format) {
  return std::make_unique<LineFormatter>(format);
}

std::string json_text(std::string_view text) {
  return nlohmann::json(std::string(text)).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace handloft
