#include "daemon-tracking/source/camera/recorded_camera.h"

#include <fmt/format.h>

#include "daemon-tracking/source/camera/paced_camera.h"
#include "daemon-tracking/source/recorded/recorded_stream.h"

namespace handloft::tracking {

Result<std::unique_ptr<CameraSource>> open_recorded_camera(const std::filesystem::path& path, const Rig& rig,
                                                           std::uint32_t camera, const Clock& clock,
                                                           PaceOptions options) {
  if (camera >= rig.cameras.size()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, the rig has {} cameras", camera, rig.cameras.size()), "camera");
  }
  const std::string name = "camera/" + rig.cameras[camera].name;
  auto stream = RecordedStream::open(path, {RecordedSelection::Kind::camera, camera, name});
  if (!stream) return stream.error();
  return std::unique_ptr<CameraSource>(
      std::make_unique<PacedCamera>(camera, name, std::move(*stream), clock, options));
}

}  // namespace handloft::tracking
