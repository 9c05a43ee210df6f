#include "daemon-tracking/fusion/prediction.h"

#include "daemon-tracking/vision/body_pose.h"

namespace handloft::tracking {

namespace {
// Growth of a prediction's variance: the speed changes by a random walk of this density (m^2/s^3, rad^2/s^3).
constexpr double hand_acceleration_density = 9.0;
constexpr double head_acceleration_density = 4.0;
constexpr double head_angular_density = 64.0;

double grown_variance(double density, double ahead_s) {
  return ahead_s > 0.0 ? density * ahead_s * ahead_s * ahead_s / 3.0 : 0.0;
}
}  // namespace

FusedTip predict(const FusedTip& tip, double ahead_s, const PredictionLimits& limits) {
  FusedTip out = tip;
  out.position_m = predict_position(tip.position_m, tip.velocity_m_s, ahead_s, limits);
  out.velocity_m_s = tip.velocity_m_s * remaining_speed(ahead_s, limits);
  out.covariance_m2 += Eigen::Matrix3d::Identity() * grown_variance(hand_acceleration_density, ahead_s);
  return out;
}

FusedHead predict(const FusedHead& head, double ahead_s, const PredictionLimits& limits) {
  FusedHead out = head;
  out.position_m = predict_position(head.position_m, head.velocity_m_s, ahead_s, limits);
  out.orientation = predict_orientation(head.orientation, head.angular_velocity_rad_s, ahead_s, limits);
  const double left = remaining_speed(ahead_s, limits);
  out.velocity_m_s = head.velocity_m_s * left;
  out.angular_velocity_rad_s = head.angular_velocity_rad_s * left;
  out.covariance.topLeftCorner<3, 3>().diagonal().array() +=
      grown_variance(head_acceleration_density, ahead_s);
  out.covariance.bottomRightCorner<3, 3>().diagonal().array() +=
      grown_variance(head_angular_density, ahead_s);
  return out;
}

}  // namespace handloft::tracking
