#include "daemon-tracking/fusion/fingertip_filter.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace handloft::tracking {

void FingertipFilter::motion(double dt_s, double density, const FingertipFilterOptions& options,
                             Matrix6d& transition, Matrix6d& noise) {
  // Integrated Ornstein-Uhlenbeck process (Gillespie 1996), per axis: dv = -v/tau dt + q dW, dx = v dt.
  const double tau = options.velocity_decay_s;
  const double decay = std::exp(-dt_s / tau);
  const double way = tau * -std::expm1(-dt_s / tau);
  transition.setIdentity();
  transition.topRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * way;
  transition.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * decay;
  // For dt << tau, which the step limit ensures, the white-acceleration covariance is exact to first order in
  // dt/tau.
  const double step = std::clamp(dt_s, 0.0, options.max_step_s);
  const double q = density * density;
  noise.setZero();
  noise.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() * (q * step * step * step / 3.0);
  noise.topRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * (q * step * step / 2.0);
  noise.bottomLeftCorner<3, 3>() = noise.topRightCorner<3, 3>();
  noise.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * (q * step);
}

void FingertipFilter::start(TimePoint time, const Eigen::Vector3d& position_m,
                            const Eigen::Matrix3d& covariance, const FingertipFilterOptions& options) {
  *this = FingertipFilter{};
  alive_ = position_m.allFinite() && covariance.allFinite();
  time_ = last_update_ = time;
  density_ = options.acceleration_density;
  mean_.setZero();
  mean_.head<3>() = position_m;
  covariance_.setZero();
  covariance_.topLeftCorner<3, 3>() = covariance;
  covariance_.bottomRightCorner<3, 3>() =
      Eigen::Matrix3d::Identity() * options.initial_velocity_sigma * options.initial_velocity_sigma;
}

void FingertipFilter::predict(TimePoint time, const FingertipFilterOptions& options) {
  if (!alive_ || time <= time_) return;
  Matrix6d transition, noise;
  density_ = jerking() ? options.jerk_density : options.acceleration_density;
  motion(to_seconds(time - time_), density_, options, transition, noise);
  mean_ = transition * mean_;
  covariance_ = transition * covariance_ * transition.transpose() + noise;
  time_ = time;
  const double worst = covariance_.topLeftCorner<3, 3>().diagonal().maxCoeff();
  if (!mean_.allFinite() || !covariance_.allFinite() || velocity().norm() > options.max_speed_m_s ||
      worst > options.max_sigma_m * options.max_sigma_m)
    alive_ = false;
}

std::optional<FingertipFilter::Expected> FingertipFilter::expected(const CameraModel& camera,
                                                                   const Eigen::Isometry3d& world_from_camera,
                                                                   double delay_s) const {
  const Eigen::Matrix3d camera_from_world = world_from_camera.linear().transpose();
  const auto projection = camera.project_with_jacobian(
      camera_from_world * (position() + delay_s * velocity() - world_from_camera.translation()));
  if (!projection) return std::nullopt;
  Expected out;
  out.pixel = projection->pixel;
  out.jacobian = projection->jacobian * camera_from_world;
  out.delay_s = delay_s;
  const Eigen::Matrix3d across = delay_s * covariance_.topRightCorner<3, 3>();
  const Eigen::Matrix3d spread = covariance_.topLeftCorner<3, 3>() + across + across.transpose() +
                                 delay_s * delay_s * covariance_.bottomRightCorner<3, 3>();
  out.covariance = out.jacobian * spread * out.jacobian.transpose();
  return out;
}

double FingertipFilter::update(const Expected& expectation, const Eigen::Vector2d& pixel,
                               const Eigen::Matrix2d& covariance, std::uint32_t camera, TimePoint time) {
  Eigen::Matrix<double, 2, 6> observe = Eigen::Matrix<double, 2, 6>::Zero();
  observe.leftCols<3>() = expectation.jacobian;
  observe.rightCols<3>() = expectation.delay_s * expectation.jacobian;
  const Eigen::Matrix2d innovation_inverse = (expectation.covariance + covariance).inverse();
  const Eigen::Vector2d innovation = pixel - expectation.pixel;
  const Eigen::Matrix<double, 6, 2> gain = covariance_ * observe.transpose() * innovation_inverse;
  mean_ += gain * innovation;
  const Matrix6d keep = Matrix6d::Identity() - gain * observe;
  covariance_ = keep * covariance_ * keep.transpose() + gain * covariance * gain.transpose();
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
  if (!mean_.allFinite() || !covariance_.allFinite()) alive_ = false;
  last_update_ = time;
  gated_running = 0;
  mark_seen(camera, time);
  return innovation.dot(innovation_inverse * innovation);
}

void FingertipFilter::update_velocity(const Eigen::Vector3d& velocity_m_s, double sigma_m_s) {
  const Eigen::Matrix3d noise = Eigen::Matrix3d::Identity() * sigma_m_s * sigma_m_s;
  const Eigen::Matrix3d innovation_inverse = (covariance_.bottomRightCorner<3, 3>() + noise).inverse();
  const Eigen::Matrix<double, 6, 3> gain = covariance_.rightCols<3>() * innovation_inverse;
  mean_ += gain * (velocity_m_s - velocity());
  Matrix6d keep = Matrix6d::Identity();
  keep.rightCols<3>() -= gain;
  covariance_ = keep * covariance_ * keep.transpose() + gain * noise * gain.transpose();
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
  if (!mean_.allFinite() || !covariance_.allFinite()) alive_ = false;
}

void FingertipFilter::mark_seen(std::uint32_t camera, TimePoint time) {
  if (camera < max_cameras) seen_ns_[camera] = std::max<std::int64_t>(to_ns(time), 1);
}

std::uint32_t FingertipFilter::cameras_within(TimePoint time, Duration within) const {
  std::uint32_t mask = 0;
  for (std::size_t camera = 0; camera < seen_ns_.size(); ++camera)
    if (seen_ns_[camera] != 0 && to_ns(time) - seen_ns_[camera] <= within.count()) mask |= 1u << camera;
  return mask;
}

}  // namespace handloft::tracking
