#pragma once
// `handloft-trackd devices`: the cameras with their modes, and the gloves, pens and 3D mice that are plugged
// in, each with the identity that stays the same over restarts (T2).

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/main/options.h"
#include "daemon-tracking/source/camera/v4l2_enumerate.h"
#include "daemon-tracking/source/hotplug.h"

namespace handloft::tracking {

enum class InputKind : std::uint8_t { glove, pen, space_mouse, serial_line };
std::string_view to_string(InputKind kind);

struct InputDevice {
  InputKind kind = InputKind::glove;
  PluggedDevice device;
};

struct FoundDevices {
  std::vector<V4l2CameraInfo> cameras;
  std::vector<InputDevice> inputs;
};

/// Which of what is plugged in are input devices of ours, by their numbers. A serial line may be a
/// LucidGloves-compatible glove: only its user knows.
std::vector<InputDevice> input_devices(const std::vector<PluggedDevice>& plugged);

/// Asks the kernel. Errors: io when what is plugged in can't be looked up.
Result<FoundDevices> find_devices();

/// For people; names that devices gave themselves are made printable.
std::string devices_text(const FoundDevices& found);
std::string devices_json(const FoundDevices& found);

/// Prints to standard output; the exit status.
int run_devices(const DaemonOptions& options);

/// `text` with every control character replaced: what devices call themselves goes to a terminal.
std::string printable(std::string_view text);

}  // namespace handloft::tracking
