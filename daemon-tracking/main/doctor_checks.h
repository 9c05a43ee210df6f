#pragma once
// What `handloft-trackd doctor` looks at, one function a subject: each says whether all is well, what is
// missing or set wrongly, and the remedy. What they look at is handed to them, so that tests can be any
// computer.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/main/devices_command.h"
#include "daemon-tracking/source/calibration_file.h"

namespace handloft::tracking {

struct Finding {
  enum class Level : std::uint8_t { ok, warn, fail };
  Level level = Level::ok;
  std::string subject;  ///< "calibration", "camera left"
  std::string words;    ///< What was found.
  std::string remedy;   ///< What to do; empty when all is well.
};

/// Whether this user may open a device's node for reading and writing.
using MayOpen = std::function<bool(const std::string& node)>;

/// One finding for the file, then one a calibrated camera: is it plugged in, does it still have the mode that
/// was calibrated, did its calibration come out well? And one a camera that is in no calibration.
std::vector<Finding> check_calibrated_cameras(const Result<Calibration>& calibration,
                                              const std::vector<V4l2CameraInfo>& cameras);
/// Whether the calibrated modes fit through their USB buses together.
std::vector<Finding> check_usb_bandwidth(const Calibration& calibration,
                                         const std::vector<V4l2CameraInfo>& cameras);
/// Gloves, pens and 3D mice, and whether they may be opened.
std::vector<Finding> check_inputs(const std::vector<InputDevice>& inputs, const MayOpen& may_open);
/// Our udev rules, in one of udev's folders below `root`.
Finding check_udev_rules(const std::filesystem::path& root);
/// `runtime`: $XDG_RUNTIME_DIR, or null.
Finding check_runtime_folder(const char* runtime);
/// Frequency governor, clock source and number of processors, from /sys below `root`.
std::vector<Finding> check_machine(const std::filesystem::path& root, unsigned processors);
/// Both HID libraries, which are loaded when they are needed.
Finding check_hid_library(const std::function<bool(const char* name)>& can_load);
/// A daemon at the socket: `answer` is what asking it came to, an empty error text when it answered.
Finding check_socket(const std::string& endpoint, const std::optional<Error>& answer);

std::string findings_text(const std::vector<Finding>& findings);
std::string findings_json(const std::vector<Finding>& findings);
bool any_failed(const std::vector<Finding>& findings);

}  // namespace handloft::tracking
