#pragma once
// The pose of one rigid body with several tags from all corners that any number of calibrated cameras saw at
// one time (T5). A single square seen almost frontally has two poses with nearly the same error (Schweighofer
// and Pinz 2006; Collins and Bartoli 2014): every tag's two poses (IPPE) are kept as candidates, each is
// refined against *all* corners, and the one wins that other tags, other cameras and, at last, the prior
// agree with.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/camera_model.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A tag's corner: where it is and where it was seen.
struct CornerMeasurement {
  Eigen::Vector3d point_m;  ///< In the frame of what carries the tag
  Eigen::Vector2d pixel;    ///< As measured, distorted
};

/// Who carries the camera: the base looks at the body's tags, or the body carries the camera and looks at the
/// base's. A head is found both ways, from the table's cameras and by its own.
enum class CameraOn { base, body };

/// What one camera saw. Four consecutive corners are one tag.
struct BodyView {
  const CameraModel* camera = nullptr;  ///< Outlives the call
  CameraOn on = CameraOn::base;
  Eigen::Isometry3d carrier_from_camera = Eigen::Isometry3d::Identity();
  std::vector<CornerMeasurement> corners;  ///< On the body (camera on the base), or the other way round
};

/// What is believed of the pose beforehand: mean and covariance of (translation in the base frame, rotation
/// vector applied on the left).
struct PosePrior {
  Eigen::Isometry3d base_from_body;
  Matrix6d covariance;
};

struct BodyPoseOptions {
  double corner_sigma_px = 0.3;  ///< Measured on rendered tags with refined edges.
  double huber_sigmas = 2.5;     ///< Residuals beyond are weighted down.
  int max_iterations = 20;
  double converged_cost = 1e-12;  ///< Change of the cost (squared sigmas) that is only rounding
  double max_rms_px = 3.0;        ///< A worse fit is no pose.
};

struct BodyPose {
  Eigen::Isometry3d base_from_body = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Identity();  ///< (translation m, rotation rad), base frame, from J^T J
  double reprojection_rms_px = 0.0;
  int tags = 0;
  int views = 0;
  /// Cost of the second best distinct pose over that of the best; near 1 the view is ambiguous and only a
  /// prior decided. Infinity when there was no second.
  double ambiguity_ratio = 0.0;
};

/// Corners of a placed tag in the body's frame, in the order of TagDetection.
std::array<Eigen::Vector3d, 4> tag_corners(const TagPlacement& tag);

/// The corners of those `tags` that are placed in `placements`, as one view.
BodyView make_view(const CameraModel& camera, CameraOn on, const Eigen::Isometry3d& carrier_from_camera,
                   std::span<const TagDetection> tags, std::span<const TagPlacement> placements);

/// Refines a pose: Levenberg-Marquardt (Ceres) on Huber's loss of the reprojection errors, plus the prior
/// when given. Fails with failed_precondition when it does not converge to a pose in front of the cameras.
Result<BodyPose> refine_body_pose(std::span<const BodyView> views, const Eigen::Isometry3d& start,
                                  const std::optional<PosePrior>& prior, const BodyPoseOptions& options = {});

/// Finds and refines a pose. Fails with failed_precondition for fewer than 4 corners or no consistent pose,
/// invalid_argument for values that are not finite.
Result<BodyPose> solve_body_pose(std::span<const BodyView> views, const std::optional<PosePrior>& prior,
                                 const BodyPoseOptions& options = {});

/// exp of a rotation vector.
Eigen::Quaterniond rotation_from_vector(const Eigen::Vector3d& rotation_rad);
/// log of a rotation, angle in [0, pi].
Eigen::Vector3d vector_from_rotation(const Eigen::Quaterniond& rotation);
/// Cross-product matrix: skew(a) b = a x b.
Eigen::Matrix3d skew(const Eigen::Vector3d& a);

}  // namespace handloft::tracking
