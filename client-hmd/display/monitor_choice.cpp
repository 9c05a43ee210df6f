#include "client-hmd/display/monitor_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace handloft::client {
namespace {

bool usable(const MonitorInfo& monitor) {
  return monitor.width_px > 0 && monitor.height_px > 0;
}

}  // namespace

std::string describe(const std::vector<MonitorInfo>& monitors) {
  std::string text;
  for (std::size_t i = 0; i < monitors.size(); ++i) {
    const MonitorInfo& monitor = monitors[i];
    text += fmt::format("{}: {}, {}x{} at {} Hz\n", i, monitor.name, monitor.width_px, monitor.height_px,
                        monitor.refresh_hz);
  }
  return text.empty() ? "no monitors\n" : text;
}

std::optional<MonitorInfo> find_monitor(const std::vector<MonitorInfo>& monitors, std::string_view wanted) {
  if (wanted.empty()) return std::nullopt;
  for (const MonitorInfo& monitor : monitors) {
    if (monitor.name == wanted && usable(monitor)) return monitor;
  }
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
  if (error == std::errc() && end == wanted.data() + wanted.size() && number < monitors.size()) {
    return usable(monitors[number]) ? std::optional(monitors[number]) : std::nullopt;
  }
  const auto holds = [wanted](const MonitorInfo& monitor) {
    return usable(monitor) && monitor.name.find(wanted) != std::string::npos;
  };
  if (std::count_if(monitors.begin(), monitors.end(), holds) != 1) return std::nullopt;
  return *std::find_if(monitors.begin(), monitors.end(), holds);
}

std::optional<Placement> MonitorChoice::after_change(const std::vector<MonitorInfo>& monitors) {
  if (!wanted_) return std::nullopt;
  Placement placement;
  placement.cover = find_monitor(monitors, found_name_.value_or(*wanted_));
  if (placement.cover) {
    if (last_ && !last_->cover) placement.said = fmt::format("monitor {} is back", placement.cover->name);
    found_name_ = placement.cover->name;
  } else if (found_name_) {
    placement.said = fmt::format("monitor {} was unplugged: showing a window until it is back", *found_name_);
  } else {
    placement.said = fmt::format("no monitor '{}': showing a window until there is one", *wanted_);
  }
  if (last_ && last_->cover == placement.cover) return std::nullopt;
  last_ = placement;
  return placement;
}

}  // namespace handloft::client
