#pragma once
// Reprojection errors of a body's pose as a least-squares problem (Hartley and Zisserman, chapter 6; the
// bundle adjustment of one body), in the form that the solvers of Ceres take: residuals and their Jacobian as
// functions of a small motion about a start. Parameters: (translation m, rotation vector rad, applied on the
// left), in the base's frame, 0 at the start.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "daemon-tracking/vision/body_pose.h"

namespace handloft::tracking {

/// The pose after a motion (translation, rotation vector on the left) in the base's frame.
Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Vector6d& motion);

/// Root mean square distance of corners from where they were seen, in pixels; nullopt when one is not in
/// front of its camera or there is none.
std::optional<double> reprojection_rms_px(std::span<const BodyView> views,
                                          const Eigen::Isometry3d& base_from_body);

/// A corner's image and how it moves with (translation, rotation on the left) of the body.
struct CornerImage {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 6> jacobian;
};

/// nullopt when the corner is not in front of the view's camera.
std::optional<CornerImage> image_of(const BodyView& view, const CornerMeasurement& corner,
                                    const Eigen::Isometry3d& base_from_body);

/// How exp(v) turns on the left when v changes: exp(v + dv) = exp(J dv) exp(v) (Barfoot 2017, 7.1.5).
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_rad);

/// A corner's error in sigmas, shrunk beyond `huber_sigmas` so that the squares add up to the loss of Huber
/// (1964), and its slope over the error in pixels.
struct RobustError {
  Eigen::Vector2d residual;
  Eigen::Matrix2d slope;
};
RobustError robust_error(const Eigen::Vector2d& error_px, const BodyPoseOptions& options);

/// Two residuals per corner in sigmas, shrunk beyond `huber_sigmas` so that their squares add up to the loss
/// of Huber (1964), and six of the prior when there is one. The views must outlive it.
class BodyPoseCost {
 public:
  // The names are those of ceres::TinySolver.
  using Scalar = double;
  // NOLINTBEGIN(readability-identifier-naming)
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 6 };

  /// nullopt when the prior's covariance is not positive definite.
  static std::optional<BodyPoseCost> create(std::span<const BodyView> views, const Eigen::Isometry3d& start,
                                            const std::optional<PosePrior>& prior,
                                            const BodyPoseOptions& options);

  int NumResiduals() const { return residuals_; }
  // NOLINTEND(readability-identifier-naming)

  /// Fills `residuals` (NumResiduals) and, unless null, `jacobian` (NumResiduals x 6, column-major). False
  /// when a corner would not be in front of its camera: residuals are then so large that no solver stays.
  bool operator()(const double* motion, double* residuals, double* jacobian) const;

 private:
  BodyPoseCost(std::span<const BodyView> views, const Eigen::Isometry3d& start,
               const BodyPoseOptions& options)
      : views_(views), start_(start), options_(options) {}

  std::span<const BodyView> views_;
  Eigen::Isometry3d start_;
  BodyPoseOptions options_;
  std::optional<Eigen::Isometry3d> prior_;
  Matrix6d prior_whitening_ = Matrix6d::Zero();  ///< L^-1 of covariance = L L^T
  int residuals_ = 0;
};

}  // namespace handloft::tracking
