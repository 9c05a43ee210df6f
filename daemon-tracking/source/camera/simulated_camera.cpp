#include "daemon-tracking/source/camera/simulated_camera.h"

#include "daemon-tracking/source/camera/paced_camera.h"

namespace handloft::tracking {

std::unique_ptr<CameraSource> make_simulated_camera(std::shared_ptr<const SimulatedScene> scene,
                                                    std::uint32_t camera, const Clock& clock,
                                                    PaceOptions options) {
  std::string name = "camera/" + scene->rig.cameras.at(camera).name;
  return std::make_unique<PacedCamera>(camera, std::move(name),
                                       simulated_camera_stream(std::move(scene), camera), clock, options);
}

}  // namespace handloft::tracking
