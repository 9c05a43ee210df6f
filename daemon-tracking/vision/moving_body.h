#pragma once
// One view's correction of a body that moves while a rolling shutter exposes it row by row: pose and
// velocities together, every corner at its own row's time (an iterated extended Kalman update; Bell and
// Cathey 1993). With all delays 0 it is the update by a still picture.

#include <Eigen/Core>
#include <span>

#include "common/base/result.h"
#include "daemon-tracking/vision/body_pose.h"

namespace handloft::tracking {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// A body at a time: pose, velocity (m/s) and angular velocity (rad/s, on the left), in the base's frame.
struct MovingBody {
  Eigen::Isometry3d base_from_body = Eigen::Isometry3d::Identity();
  Vector6d rate = Vector6d::Zero();
  /// Of (translation m, rotation rad on the left, velocity, angular velocity).
  Matrix12d covariance = Matrix12d::Identity();
};

struct MovingBodyFit {
  MovingBody body;
  double reprojection_rms_px = 0.0;
  int tags = 0;
  double surprise = 0.0;  ///< Squared sigmas of the pose's step, by what was believed before.
};

/// `prior`: what is believed at the view's own time, which stays the result's. `delays_s[i]`: how much later
/// corner i was exposed. Begins at the prior, so the other pose of an ambiguous tag is not gone to. Errors:
/// failed_precondition when nothing in front of the camera explains the corners, invalid_argument for values
/// that are not finite or a number of delays that is not the corners'.
Result<MovingBodyFit> correct_moving_body(const BodyView& view, std::span<const double> delays_s,
                                          const MovingBody& prior, const BodyPoseOptions& options = {});

}  // namespace handloft::tracking
