#include "daemon-tracking/vision/reprojection.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace handloft::tracking {

namespace {

// Far above any residual of a pose that shows all corners, and its square still a number.
constexpr double out_of_sight = 1e30;
constexpr double small_angle_rad = 1e-4;
constexpr int corner_residuals = 2;
constexpr int prior_residuals = 6;

}  // namespace

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  const Eigen::Matrix3d cross = skew(rotation_rad);
  const bool small = angle < small_angle_rad;
  const double first = small ? 0.5 : (1.0 - std::cos(angle)) / (angle * angle);
  const double second = small ? 1.0 / 6.0 : (angle - std::sin(angle)) / (angle * angle * angle);
  return Eigen::Matrix3d::Identity() + first * cross + second * cross * cross;
}

std::optional<CornerImage> image_of(const BodyView& view, const CornerMeasurement& corner,
                                    const Eigen::Isometry3d& base_from_body) {
  const Eigen::Matrix3d rotation = base_from_body.linear();
  const Eigen::Matrix3d camera_from_carrier = view.carrier_from_camera.linear().transpose();
  Eigen::Vector3d in_carrier;
  Eigen::Matrix<double, 3, 6> motion;
  if (view.on == CameraOn::base) {
    const Eigen::Vector3d arm = rotation * corner.point_m;
    in_carrier = arm + base_from_body.translation();
    motion << Eigen::Matrix3d::Identity(), -skew(arm);
  } else {
    const Eigen::Vector3d arm = corner.point_m - base_from_body.translation();
    in_carrier = rotation.transpose() * arm;
    motion << -rotation.transpose(), rotation.transpose() * skew(arm);
  }
  const auto projection = view.camera->project_with_jacobian(
      camera_from_carrier * (in_carrier - view.carrier_from_camera.translation()));
  if (!projection) return std::nullopt;
  return CornerImage{projection->pixel, projection->jacobian * camera_from_carrier * motion};
}

RobustError robust_error(const Eigen::Vector2d& error_px, const BodyPoseOptions& options) {
  const Eigen::Vector2d error = error_px / options.corner_sigma_px;
  const double sigmas = error.norm();
  if (!(sigmas > options.huber_sigmas)) return {error, Eigen::Matrix2d::Identity() / options.corner_sigma_px};
  // How the loss bends the error's length and its direction.
  const double length = std::sqrt(options.huber_sigmas * (2.0 * sigmas - options.huber_sigmas));
  const double along = options.huber_sigmas / length, across = length / sigmas;
  const Eigen::Vector2d direction = error / sigmas;
  return {across * error,
          (Eigen::Matrix2d::Identity() * across + (along - across) * direction * direction.transpose()) /
              options.corner_sigma_px};
}

Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Vector6d& motion) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  const Eigen::Quaterniond rotation =
      (rotation_from_vector(motion.tail<3>()) * Eigen::Quaterniond(pose.linear())).normalized();
  out.linear() = rotation.toRotationMatrix();
  out.translation() = pose.translation() + motion.head<3>();
  return out;
}

std::optional<double> reprojection_rms_px(std::span<const BodyView> views,
                                          const Eigen::Isometry3d& base_from_body) {
  double squares = 0.0;
  std::size_t corners = 0;
  for (const BodyView& view : views) {
    for (const CornerMeasurement& corner : view.corners) {
      const auto image = image_of(view, corner, base_from_body);
      if (!image) return std::nullopt;
      squares += (image->pixel - corner.pixel).squaredNorm();
      ++corners;
    }
  }
  if (corners == 0) return std::nullopt;
  return std::sqrt(squares / static_cast<double>(corners));
}

std::optional<BodyPoseCost> BodyPoseCost::create(std::span<const BodyView> views,
                                                 const Eigen::Isometry3d& start,
                                                 const std::optional<PosePrior>& prior,
                                                 const BodyPoseOptions& options) {
  BodyPoseCost cost(views, start, options);
  for (const BodyView& view : views)
    cost.residuals_ += corner_residuals * static_cast<int>(view.corners.size());
  if (prior) {
    const Eigen::LLT<Matrix6d> factor(prior->covariance);
    if (factor.info() != Eigen::Success) return std::nullopt;
    cost.prior_ = prior->base_from_body;
    cost.prior_whitening_ = factor.matrixL().solve(Matrix6d::Identity());
    if (!cost.prior_whitening_.allFinite()) return std::nullopt;
    cost.residuals_ += prior_residuals;
  }
  return cost;
}

bool BodyPoseCost::operator()(const double* motion, double* residuals, double* jacobian) const {
  const Eigen::Map<const Vector6d> step(motion);
  Eigen::Map<Eigen::VectorXd> out(residuals, residuals_);
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6>> slope(jacobian, jacobian ? residuals_ : 0, 6);
  const Eigen::Isometry3d pose = moved(start_, step);
  const Eigen::Matrix3d turn = left_jacobian(step.tail<3>());
  Eigen::Index row = 0;
  for (const BodyView& view : views_) {
    for (const CornerMeasurement& corner : view.corners) {
      const auto image = image_of(view, corner, pose);
      if (!image) {
        out.setConstant(out_of_sight);
        slope.setZero();
        return false;
      }
      const RobustError error = robust_error(image->pixel - corner.pixel, options_);
      out.segment<2>(row) = error.residual;
      if (jacobian != nullptr) {
        slope.block<2, 3>(row, 0) = error.slope * image->jacobian.leftCols<3>();
        slope.block<2, 3>(row, 3) = error.slope * image->jacobian.rightCols<3>() * turn;
      }
      row += corner_residuals;
    }
  }
  if (prior_) {
    Vector6d difference;
    difference.head<3>() = pose.translation() - prior_->translation();
    difference.tail<3>() = vector_from_rotation(
        Eigen::Quaterniond(Eigen::Matrix3d(pose.linear() * prior_->linear().transpose())));
    out.segment<6>(row) = prior_whitening_ * difference;
    if (jacobian != nullptr) {
      Matrix6d change = Matrix6d::Identity();
      change.bottomRightCorner<3, 3>() = left_jacobian(difference.tail<3>()).inverse() * turn;
      slope.middleRows<6>(row) = prior_whitening_ * change;
    }
  }
  return true;
}

}  // namespace handloft::tracking
