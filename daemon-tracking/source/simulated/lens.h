#pragma once
// The simulated lens: pinhole and Brown-Conrady distortion (Brown 1966; k1, k2, p1, p2, k3 as in
// camera_calibration.h). Written for the renderer alone: the estimator has its own, so that an error in
// either shows in the tests.

#include <Eigen/Core>
#include <optional>

#include "daemon-tracking/source/camera_calibration.h"

namespace handloft::tracking {

class Lens {
 public:
  explicit Lens(const CameraIntrinsics& intrinsics) : intrinsics_(intrinsics) {}

  /// Pixel of a point in the camera's frame (metres); nullopt when it is not in front of the camera.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_m) const;

  /// (x, y) of the ray (x, y, 1) that is imaged at a pixel. Newton's method on the distortion, to 1e-12.
  Eigen::Vector2d ray(const Eigen::Vector2d& pixel) const;

  const CameraIntrinsics& intrinsics() const { return intrinsics_; }

 private:
  Eigen::Vector2d distort(const Eigen::Vector2d& ray) const;
  CameraIntrinsics intrinsics_;
};

}  // namespace handloft::tracking
