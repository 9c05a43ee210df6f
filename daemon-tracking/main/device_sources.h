#pragma once
// The devices of this computer as sources (T1 to T3): a camera for each one of the calibration, and gloves,
// pens and 3D mice as they are plugged in. A camera that fits no calibration is told as unmatched and not
// used; a calibration whose camera is missing waits for it.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "daemon-tracking/main/device_book.h"
#include "daemon-tracking/source/calibration_file.h"
#include "daemon-tracking/source/camera/v4l2_camera.h"
#include "daemon-tracking/source/device_status.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/hotplug.h"
#include "daemon-tracking/source/sample_source.h"

namespace handloft::tracking {

/// What the V4L2 camera is asked for, so that it is the one that was calibrated, as it was calibrated.
/// Precondition: camera < calibration.cameras.size().
V4l2CameraOptions camera_options(const Calibration& calibration, std::size_t camera);

/// A camera's health as facts; `record` says what was calibrated. A picture size other than the calibrated
/// one is a problem, whatever the camera says itself.
DeviceFacts facts_of(const std::string& device, const CameraHealth& health, const Calibration& calibration,
                     std::size_t camera);

/// The cameras that are plugged in, but fit no record of the calibration, as facts: "camera/unmatched-1"...
std::vector<DeviceFacts> unmatched_cameras(const std::vector<V4l2Node>& nodes,
                                           const Calibration& calibration);

struct DeviceSourceOptions {
  /// The line of a LucidGloves-compatible glove (SerialGloveOptions::line), instead of one over USB HID.
  std::optional<std::string> serial_glove;
};

/// An input device's status as facts. One that nobody plugged in is no problem.
DeviceFacts facts_of(const std::string& device, const DeviceStatus& status);

class DeviceSources {
 public:
  /// Opens nothing yet. Errors: io when plugging can't be watched, invalid_argument for the options.
  static Result<std::unique_ptr<DeviceSources>> open(const Calibration& calibration,
                                                     const DeviceSourceOptions& options, const Clock& clock,
                                                     const Logger& log);
  /// All sources must have been stopped.
  ~DeviceSources();
  DeviceSources(const DeviceSources&) = delete;
  DeviceSources& operator=(const DeviceSources&) = delete;

  /// Owned here.
  std::vector<SampleSource*> sources() const;
  /// As of now. One thread at a time.
  std::vector<DeviceFacts> facts();
  /// Light and vibration for whoever wears the glove. Any thread; quick.
  void show(const GloveOutput& output);

 private:
  struct Implementation;
  explicit DeviceSources(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::tracking
