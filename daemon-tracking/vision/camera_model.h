#pragma once
// The pinhole camera with Brown-Conrady distortion (D. C. Brown 1971; OpenCV's k1, k2, p1, p2, k3), points
// only: images are never undistorted. Camera frame x right, y down, z forward, metres; pixels with the centre
// of the top left pixel at (0, 0). Pure and thread-safe.

#include <Eigen/Core>
#include <optional>

#include "common/base/result.h"
#include "daemon-tracking/source/camera_calibration.h"

namespace handloft::tracking {

/// The image of a point and how it moves with the point.
struct Projection {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3>
      jacobian;  ///< d pixel / d point (px per metre), the point in the camera's frame
};

class CameraModel {
 public:
  /// Fails with invalid_argument when a value is not finite, a focal length or size is not positive, or the
  /// size is above `max_image_side_px`.
  static Result<CameraModel> create(const CameraIntrinsics& intrinsics);

  /// nullopt for a point behind or almost in the plane of the camera, not finite, or so far outside that the
  /// distortion polynomial folds back (it would be seen at a wrong place). The pixel may lie outside the
  /// image.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_m) const;
  std::optional<Projection> project_with_jacobian(const Eigen::Vector3d& point_m) const;

  /// The undistorted direction (x/z, y/z) that is seen at a pixel; nullopt when the inversion does not
  /// converge to 1e-9 (a pixel outside of what the model can show) or the pixel is not finite.
  std::optional<Eigen::Vector2d> unproject(const Eigen::Vector2d& pixel) const;
  /// Unit vector towards what is seen at the pixel, in the camera's frame.
  std::optional<Eigen::Vector3d> ray(const Eigen::Vector2d& pixel) const;

  bool contains(const Eigen::Vector2d& pixel, double margin_px = 0.0) const;
  const CameraIntrinsics& intrinsics() const { return intrinsics_; }

 private:
  explicit CameraModel(const CameraIntrinsics& intrinsics);
  CameraIntrinsics intrinsics_;
  double max_radius_squared_ = 0.0;  ///< Normalised radius where the radial polynomial stops growing
};

/// Sizes above this are refused everywhere: no camera of a desk delivers more, and a corrupt header may claim
/// it.
inline constexpr int max_image_side_px = 8192;

}  // namespace handloft::tracking
