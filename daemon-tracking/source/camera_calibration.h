#pragma once
// What is known of one camera: the pinhole model with Brown-Conrady distortion (OpenCV's k1, k2, p1, p2, k3)
// and where it stands. Lengths in metres, image coordinates in pixels with the centre of the top left pixel
// at (0, 0). Camera frame: x right, y down, z forward (OpenCV's).

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>

#include "common/base/clock.h"

namespace handloft::tracking {

struct CameraIntrinsics {
  int width_px = 640;
  int height_px = 480;
  double fx_px = 600.0;
  double fy_px = 600.0;
  double cx_px = 319.5;
  double cy_px = 239.5;
  std::array<double, 5> distortion{};  ///< k1, k2, p1, p2, k3
};

/// What a camera looks at: a fixed one sees the table, the head's own camera moves with the head.
enum class CameraRole { table, head };

struct CameraCalibration {
  std::string name;  ///< Unique: "left", "right", "head".
  CameraRole role = CameraRole::table;
  CameraIntrinsics intrinsics;
  /// Table cameras: the camera in the world. Head camera: the camera in the head rig's frame, see
  /// `head_from_camera`.
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d head_from_camera = Eigen::Isometry3d::Identity();
  Duration time_offset{};  ///< Added to a frame's timestamp to get the middle of its exposure (T4).
  /// From one row's exposure to the next one's (rolling shutter): a frame's time is its middle row's. 0: all
  /// at once.
  Duration row_time{};

  /// How much later than the frame a picture's row was exposed, seconds. `y_px` from the top.
  double row_delay_s(double y_px) const {
    return (y_px - 0.5 * (intrinsics.height_px - 1)) * to_seconds(row_time);
  }
};

}  // namespace handloft::tracking
