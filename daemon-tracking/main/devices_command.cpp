#include "daemon-tracking/main/devices_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/log.h"
#include "daemon-tracking/main/exit_status.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/space_mouse/space_mouse_report.h"

namespace handloft::tracking {

std::string_view to_string(InputKind kind) {
  switch (kind) {
    case InputKind::glove:
      return "glove";
    case InputKind::pen:
      return "pen";
    case InputKind::space_mouse:
      return "3D mouse";
    case InputKind::serial_line:
      return "serial line";
  }
  return "device";
}

std::string printable(std::string_view text) {
  constexpr unsigned char first_printable = 0x20, erase = 0x7F;
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    out += byte < first_printable || byte == erase ? '?' : c;
  }
  return out;
}

std::vector<InputDevice> input_devices(const std::vector<PluggedDevice>& plugged) {
  std::vector<InputDevice> inputs;
  for (const PluggedDevice& device : plugged) {
    if (device.subsystem == "hidraw" && device.vendor_id == glove_usb_vendor &&
        device.product_id == glove_usb_product) {
      inputs.push_back({InputKind::glove, device});
    } else if (device.subsystem == "hidraw" && is_known_space_mouse(device.vendor_id, device.product_id)) {
      inputs.push_back({InputKind::space_mouse, device});
    } else if (device.subsystem == "input" && device.tablet) {
      inputs.push_back({InputKind::pen, device});
    } else if (device.subsystem == "tty" && device.vendor_id != 0) {
      inputs.push_back({InputKind::serial_line, device});
    }
  }
  return inputs;
}

Result<FoundDevices> find_devices() {
  Result<std::unique_ptr<HotplugMonitor>> plugs = open_system_hotplug({}, Logger("devices", LogLevel::off));
  if (!plugs) return plugs.error();
  return FoundDevices{list_v4l2_cameras(), input_devices((*plugs)->present())};
}

std::string devices_text(const FoundDevices& found) {
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  for (const V4l2CameraInfo& camera : found.cameras) {
    fmt::format_to(to, "camera {}  {}\n  {}\n", camera.node.node, printable(camera.model),
                   printable(camera.identity));
    if (!camera.unusable.empty()) fmt::format_to(to, "  can't be used: {}\n", printable(camera.unusable));
    for (const VideoSize& size : camera.sizes) {
      fmt::format_to(to, "  {:<6} {:>4}x{:<4} at {:.4g} Hz\n", to_string(size.format), size.width_px,
                     size.height_px, fmt::join(size.rates_hz, ", "));
    }
  }
  for (const InputDevice& input : found.inputs)
    fmt::format_to(to, "{} {}\n", to_string(input.kind), printable(describe(input.device)));
  if (found.cameras.empty() && found.inputs.empty()) {
    fmt::format_to(to,
                   "no cameras, gloves, pens or 3D mice are plugged in, or this user may not see them: "
                   "`handloft-trackd doctor` tells more\n");
  }
  return fmt::to_string(out);
}

std::string devices_json(const FoundDevices& found) {
  using nlohmann::json;
  json cameras = json::array();
  for (const V4l2CameraInfo& camera : found.cameras) {
    json modes = json::array();
    for (const VideoSize& size : camera.sizes) {
      modes.push_back({{"format", std::string(to_string(size.format))},
                       {"width_px", size.width_px},
                       {"height_px", size.height_px},
                       {"rates_hz", size.rates_hz}});
    }
    cameras.push_back({{"node", camera.node.node},
                       {"model", camera.model},
                       {"serial", camera.node.serial},
                       {"path", camera.node.path},
                       {"identity", camera.identity},
                       {"driver", camera.driver},
                       {"bus", camera.node.bus},
                       {"unusable", camera.unusable},
                       {"modes", modes}});
  }
  json inputs = json::array();
  for (const InputDevice& input : found.inputs) {
    inputs.push_back(
        {{"kind", std::string(to_string(input.kind))},
         {"node", input.device.devnode},
         {"name", input.device.name},
         {"serial", input.device.serial},
         {"path", input.device.path_id},
         {"usb_id", fmt::format("{:04x}:{:04x}", input.device.vendor_id, input.device.product_id)}});
  }
  const json document = {{"cameras", cameras}, {"inputs", inputs}};
  return document.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

int run_devices(const DaemonOptions& options) {
  const Result<FoundDevices> found = find_devices();
  if (!found) {
    std::fprintf(stderr, "handloft-trackd: %s\n", found.error().describe().c_str());
    return exit_failed;
  }
  std::fputs((options.json ? devices_json(*found) : devices_text(*found)).c_str(), stdout);
  return exit_ok;
}

}  // namespace handloft::tracking
