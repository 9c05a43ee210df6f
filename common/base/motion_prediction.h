#pragma once
// Prediction of a moving thing beyond its last measurement (T8): damped constant velocity up to a horizon,
// then easing to a hold. The tracking daemon and the display client both use this one formula, so that what
// is drawn is what the daemon would have said. Constant acceleration is left out on purpose: at webcam rates
// it does worse than no prediction at all.
//
// Speed at s seconds after the measurement is v * w(s), with w(s) = exp(-s / damping_s) * e(s), and e(s) = 1
// up to the horizon, then falling linearly to 0 within ease_s. The way covered is v times the integral of w.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace handloft {

struct PredictionLimits {
  double horizon_s =
      0.060;  ///< Beyond it a hand has changed its mind: measured error grows faster than its motion.
  double ease_s = 0.060;  ///< Time in which the speed eases from the horizon's value to 0; > 0.
  double damping_s =
      0.4;  ///< Time constant by which a speed decays; > 0. A hand's strokes last about as long.
};

/// The seconds' worth of motion to apply, in [0, horizon + ease]; monotone in `ahead_s`, 0 for ahead_s <= 0
/// or NaN (the past is asked of a history, not of a prediction).
inline double motion_time(double ahead_s, const PredictionLimits& limits = {}) {
  if (!(ahead_s > 0.0)) return 0.0;
  const double tau = limits.damping_s;
  const double free = std::min(ahead_s, limits.horizon_s);
  double seconds = tau * -std::expm1(-free / tau);
  if (ahead_s > limits.horizon_s) {
    // Integral over [0, u] of exp(-s/tau) (1 - s/ease), scaled by the speed left at the horizon.
    const double u = std::min(ahead_s - limits.horizon_s, limits.ease_s);
    const double decay = std::exp(-u / tau);
    const double plain = tau * -std::expm1(-u / tau);
    const double weighted = tau * (plain - u * decay);
    seconds += std::exp(-limits.horizon_s / tau) * (plain - weighted / limits.ease_s);
  }
  return seconds;
}

/// The share of the speed that is left `ahead_s` after the measurement, in [0, 1].
inline double remaining_speed(double ahead_s, const PredictionLimits& limits = {}) {
  if (!(ahead_s > 0.0)) return 1.0;
  const double beyond = (ahead_s - limits.horizon_s) / limits.ease_s;
  return std::exp(-ahead_s / limits.damping_s) * std::clamp(1.0 - std::max(beyond, 0.0), 0.0, 1.0);
}

/// Position `ahead_s` after `position` was measured with `velocity` (units per second).
inline Eigen::Vector3d predict_position(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity,
                                        double ahead_s, const PredictionLimits& limits = {}) {
  return position + velocity * motion_time(ahead_s, limits);
}

/// Orientation `ahead_s` after `orientation` was measured; `angular_velocity` in rad/s, in the frame that the
/// orientation maps to (world). The result is a unit quaternion.
inline Eigen::Quaterniond predict_orientation(const Eigen::Quaterniond& orientation,
                                              const Eigen::Vector3d& angular_velocity, double ahead_s,
                                              const PredictionLimits& limits = {}) {
  const double speed = angular_velocity.norm();
  const double angle = speed * motion_time(ahead_s, limits);
  if (!(angle > 1e-12)) return orientation.normalized();
  return (Eigen::Quaterniond(Eigen::AngleAxisd(angle, angular_velocity / speed)) * orientation).normalized();
}

}  // namespace handloft
