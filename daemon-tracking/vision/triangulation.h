#pragma once
// A point from the directions in which two or more calibrated cameras see it at one time (Hartley and
// Zisserman, chapter 12): the linear solution weighted by pixel covariance, then Levenberg-Marquardt (Ceres)
// on the reprojection error.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "common/base/result.h"
#include "daemon-tracking/vision/camera_model.h"

namespace handloft::tracking {

struct PointView {
  const CameraModel* camera = nullptr;  ///< Outlives the call
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();
  Eigen::Vector2d pixel{0, 0};  ///< As measured, distorted
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
};

struct TriangulationOptions {
  double min_ray_angle_rad = 0.17;  ///< 10 degrees: below, the depth is a guess.
  double max_sigmas = 4.0;          ///< Largest Mahalanobis reprojection error of a view.
  int max_iterations = 20;
};

struct TriangulatedPoint {
  Eigen::Vector3d position_m{0, 0, 0};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  double worst_sigmas = 0.0;      ///< Largest Mahalanobis reprojection error
  double widest_angle_rad = 0.0;  ///< Between two rays
};

/// Errors: failed_precondition for fewer than two views, rays too parallel, a point behind a camera, or views
/// that disagree; invalid_argument for values that are not finite.
Result<TriangulatedPoint> triangulate(std::span<const PointView> views,
                                      const TriangulationOptions& options = {});

}  // namespace handloft::tracking
