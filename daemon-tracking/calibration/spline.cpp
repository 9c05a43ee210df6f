#include "daemon-tracking/calibration/spline.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "daemon-tracking/vision/body_pose.h"

namespace handloft::tracking {
namespace {

std::array<double, 4> weights(double u) {
  const double u2 = u * u, u3 = u2 * u;
  return {(1 - 3 * u + 3 * u2 - u3) / 6, (4 - 6 * u2 + 3 * u3) / 6, (1 + 3 * u + 3 * u2 - 3 * u3) / 6,
          u3 / 6};
}
std::array<double, 4> slopes(double u) {
  const double u2 = u * u;
  return {(-1 + 2 * u - u2) / 2, (-4 * u + 3 * u2) / 2, (1 + 2 * u - 3 * u2) / 2, u2 / 2};
}

// How much a bend of the control polygon counts against a measured pose: only where there are none.
constexpr double smoothness = 1e-4;

}  // namespace

Eigen::Matrix3d left_jacobian_of(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  const Eigen::Matrix3d cross = skew(rotation_rad);
  if (angle < 1e-6) return Eigen::Matrix3d::Identity() + 0.5 * cross;
  const double a2 = angle * angle;
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / a2 * cross +
         (angle - std::sin(angle)) / (a2 * angle) * cross * cross;
}

PoseSpline::PoseSpline(double begin_s, double end_s, double knot_s, std::span<const TimedPose> poses)
    : begin_s_(begin_s), knot_s_(knot_s), reference_(poses[poses.size() / 2].pose.linear()) {
  const auto count = static_cast<std::size_t>(std::ceil((end_s - begin_s) / knot_s)) + 3;
  controls_.assign(count, Control::Zero());
  const auto n = static_cast<Eigen::Index>(count);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n, 6);
  for (const TimedPose& pose : poses) {
    Control value;
    value << pose.pose.translation(),
        vector_from_rotation(Eigen::Quaterniond(pose.pose.linear() * reference_.transpose()));
    const auto [first, u] = place(pose.time_s);
    const auto w = weights(u);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto row = static_cast<Eigen::Index>(first + i);
      right.row(row) += w[i] * value.transpose();
      for (std::size_t j = 0; j < 4; ++j) matrix(row, static_cast<Eigen::Index>(first + j)) += w[i] * w[j];
    }
  }
  const Eigen::Vector3d bend(1, -2, 1);
  for (Eigen::Index i = 0; i + 2 < n; ++i) matrix.block<3, 3>(i, i) += smoothness * bend * bend.transpose();
  const Eigen::MatrixXd solved = matrix.ldlt().solve(right);
  for (std::size_t i = 0; i < count; ++i) controls_[i] = solved.row(static_cast<Eigen::Index>(i)).transpose();
}

std::pair<std::size_t, double> PoseSpline::place(double time_s) const {
  const double spans = static_cast<double>(controls_.size() - 3);
  const double at = std::clamp((time_s - begin_s_) / knot_s_, 0.0, spans);
  const double first = std::min(std::floor(at), spans - 1);
  return {static_cast<std::size_t>(first), at - first};
}

SplinePoint PoseSpline::at(double time_s) const {
  const auto [first, u] = place(time_s);
  return blend(first, u,
               {controls_[first], controls_[first + 1], controls_[first + 2], controls_[first + 3]});
}

std::optional<SplinePoint> PoseSpline::at(double time_s, std::size_t window,
                                          std::span<const double* const> values) const {
  const auto [first, u] = place(time_s);
  if (first < window || first + 4 > window + values.size()) return std::nullopt;
  std::array<Control, 4> controls;
  for (std::size_t i = 0; i < controls.size(); ++i)
    controls[i] = Eigen::Map<const Control>(values[first - window + i]);
  return blend(first, u, controls);
}

SplinePoint PoseSpline::blend(std::size_t first, double u, const std::array<Control, 4>& controls) const {
  SplinePoint point;
  point.first = first;
  point.weights = weights(u);
  const auto slope = slopes(u);
  Control value = Control::Zero(), rate = Control::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    value += point.weights[i] * controls[i];
    rate += slope[i] / knot_s_ * controls[i];
  }
  const Eigen::Vector3d rotation = value.tail<3>();
  point.left_jacobian = left_jacobian_of(rotation);
  point.pose = Eigen::Isometry3d::Identity();
  point.pose.linear() = rotation_from_vector(rotation).toRotationMatrix() * reference_;
  point.pose.translation() = value.head<3>();
  point.velocity_m_s = rate.head<3>();
  point.angular_rad_s = point.left_jacobian * rate.tail<3>();
  return point;
}

}  // namespace handloft::tracking
