#pragma once
// Where a step's samples come from: a recording, a folder of pictures, the simulated rig, or live devices.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/calibrate/options.h"
#include "daemon-tracking/calibration/image_folder.h"
#include "daemon-tracking/source/calibration_file.h"
#include "daemon-tracking/source/sample_stream.h"
#include "daemon-tracking/vision/image_decode.h"

namespace handloft::tracking {

struct Input {
  std::unique_ptr<SampleStream> stream;
  const ImageFolder* folder = nullptr;  ///< The same stream, when it is one of pictures.
  /// Live: which device each camera turned out to be.
  std::vector<std::pair<std::uint32_t, DeviceIdentity>> devices;
  /// Live: the glove that is plugged in now, nullopt for none; empty where nothing tells. Valid with the
  /// stream.
  std::function<std::optional<DeviceIdentity>()> glove;
};

/// Errors: those of the file or folder; not_found when a live camera isn't there; invalid_argument for a
/// camera that the calibration doesn't name.
Result<Input> open_input(const CalibrateOptions& options, const Calibration& calibration);

/// Whether the options leave this camera in.
bool wants_camera(const CalibrateOptions& options, const std::string& name);

/// Frame, its planes, and what to call it in messages.
using FrameVisitor = std::function<void(const CameraFrame&, const PlanarImage&, const std::string&)>;
using SampleVisitor = std::function<void(const Sample&)>;

/// Decodes every frame of the wanted cameras; `others` gets all other samples. Counts and names frames that
/// don't decode; shows progress on a terminal. Errors: failed_precondition when no frame came at all, or a
/// recording that is damaged from the start.
struct FrameCount {
  std::size_t frames = 0, broken = 0;
};
Result<FrameCount> for_each_frame(Input& input, const CalibrateOptions& options,
                                  const Calibration& calibration, DecodePlanes planes, std::FILE* terminal,
                                  const FrameVisitor& visit, const SampleVisitor& others = {});

}  // namespace handloft::tracking
