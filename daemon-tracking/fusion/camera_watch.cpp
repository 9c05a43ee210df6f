#include "daemon-tracking/fusion/camera_watch.h"

#include <fmt/core.h>

#include <algorithm>

#include "daemon-tracking/vision/body_pose.h"
#include "daemon-tracking/vision/camera_model.h"

namespace handloft::tracking {

std::string placement_problem(const CameraPlacement& placement) {
  if (!placement.moved) return {};
  return fmt::format(
      "the camera was moved: the table's tags are {:.1f} px from where it should see them; "
      "calibrate it again",
      placement.residual_px);
}

Result<CameraWatch> CameraWatch::create(const Rig& rig, const CameraWatchOptions& options) {
  CameraWatch watch;
  watch.options_ = options;
  for (const CameraCalibration& calibration : rig.cameras) {
    auto model = CameraModel::create(calibration.intrinsics);
    if (!model) return model.error();
    Camera camera;
    if (calibration.role == CameraRole::table) {
      for (const TagPlacement& tag : rig.table_tags) {
        std::array<Eigen::Vector2d, 4> pixels;
        bool visible = true;
        const auto corners = tag_corners(tag);
        for (std::size_t i = 0; i < corners.size() && visible; ++i) {
          const auto pixel = model->project(calibration.world_from_camera.inverse() * corners[i]);
          visible = pixel.has_value();
          if (pixel) pixels[i] = *pixel;
        }
        if (visible) camera.expected_px[tag.id] = pixels;
      }
    }
    watch.cameras_.push_back(std::move(camera));
    watch.placements_.push_back({calibration.name, 0.0, 0, false});
  }
  return watch;
}

void CameraWatch::update(const CameraObservation& observation) {
  if (observation.camera >= cameras_.size()) return;
  Camera& camera = cameras_[observation.camera];
  std::vector<double> distances;
  for (const TagDetection& tag : observation.tags) {
    const auto expected = camera.expected_px.find(tag.id);
    if (expected == camera.expected_px.end()) continue;
    for (std::size_t i = 0; i < tag.corners_px.size(); ++i)
      if (tag.corners_px[i].allFinite())
        distances.push_back((tag.corners_px[i] - expected->second[i]).norm());
  }
  if (distances.empty()) return;
  CameraPlacement& placement = placements_[observation.camera];
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  placement.residual_px = *middle;
  placement.corners = static_cast<int>(distances.size());
  if (placement.residual_px <= options_.moved_px) {
    camera.off_since.reset();
  } else if (!camera.off_since) {
    camera.off_since = observation.capture_time;
  }
  placement.moved = camera.off_since && observation.capture_time - *camera.off_since >= options_.moved_for;
}

}  // namespace handloft::tracking
