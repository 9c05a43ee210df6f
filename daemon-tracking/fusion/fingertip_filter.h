#pragma once
// One fingertip as an extended Kalman filter (T7): state position and velocity, world frame, m and m/s.
// Motion: the velocity decays with a time constant and is shaken by white acceleration (an integrated
// Ornstein-Uhlenbeck process, its exact discrete covariance). Measurement: a pixel in one camera. A plain
// value: copying it is saving it.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "common/base/clock.h"
#include "daemon-tracking/vision/camera_model.h"

namespace handloft::tracking {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

inline constexpr int max_cameras = 16;

struct FingertipFilterOptions {
  double velocity_decay_s = 0.5;  ///< Time constant of the velocity.
  /// (m/s^2)/sqrt(Hz). A hand mostly glides and now and then jerks; one density for both is wrong for both
  /// (measured on motion capture: live error, prediction and gate are best with this pair).
  double acceleration_density = 0.4;
  double jerk_density = 3.0;  ///< While jerking.
  double jerk_nis =
      9.2;  ///< Surprise (chi^2, 2 degrees of freedom, 1 %) from which a finger is taken to jerk,
  Duration jerk_for = std::chrono::milliseconds(60);  ///< and for how long, unless surprised again.
  double initial_velocity_sigma = 0.3;                ///< m/s, a reaching hand.
  double max_step_s = 0.1;     ///< Longer gaps count as this in the process noise (t^3 grows fast).
  double max_speed_m_s = 6.0;  ///< Faster is no hand: reset.
  double max_sigma_m = 0.25;   ///< Position known worse than this: reset.
};

class FingertipFilter {
 public:
  bool alive() const { return alive_; }
  void kill() { alive_ = false; }
  /// Starts at a triangulated point with unknown velocity.
  void start(TimePoint time, const Eigen::Vector3d& position_m, const Eigen::Matrix3d& covariance,
             const FingertipFilterOptions& options);

  /// Carries the state to `time` (never backwards). Kills the filter when it is no longer finite or sensible.
  void predict(TimePoint time, const FingertipFilterOptions& options);

  /// What a camera would measure `delay_s` from now (a rolling shutter's row, some milliseconds either way):
  /// pixel and innovation covariance without the blob's own. nullopt when the point is not in front of the
  /// camera.
  struct Expected {
    Eigen::Vector2d pixel;
    Eigen::Matrix2d covariance;
    Eigen::Matrix<double, 2, 3> jacobian;  ///< d pixel / d world position, then
    double delay_s = 0.0;
  };
  std::optional<Expected> expected(const CameraModel& camera, const Eigen::Isometry3d& world_from_camera,
                                   double delay_s = 0.0) const;

  /// Updates with a pixel and its covariance (Joseph form). Returns the normalised innovation squared.
  double update(const Expected& expectation, const Eigen::Vector2d& pixel, const Eigen::Matrix2d& covariance,
                std::uint32_t camera, TimePoint time);

  /// Updates with a velocity that is known otherwise, to `sigma_m_s` on each axis.
  void update_velocity(const Eigen::Vector3d& velocity_m_s, double sigma_m_s);

  /// Root of the summed variances of the position, in m.
  double position_sigma_m() const { return std::sqrt(covariance_.topLeftCorner<3, 3>().trace()); }

  /// A camera took part in where the filter started.
  void mark_seen(std::uint32_t camera, TimePoint time);

  TimePoint time() const { return time_; }
  const Vector6d& mean() const { return mean_; }
  const Matrix6d& covariance() const { return covariance_; }
  Eigen::Vector3d position() const { return mean_.head<3>(); }
  Eigen::Vector3d velocity() const { return mean_.tail<3>(); }
  /// Cameras that contributed within `within` before `time`.
  std::uint32_t cameras_within(TimePoint time, Duration within) const;
  TimePoint last_update() const { return last_update_; }

  int gated_running = 0;  ///< Refusals since the last update; kept by the hand filter

  /// Takes the finger to jerk from now on: the next predict() is the less sure for it.
  void jerk(Duration how_long) { jerking_until_ = time_ + how_long; }
  bool jerking() const { return jerking_until_ > time_; }
  /// The acceleration density of the last predict().
  double density() const { return density_; }

  /// Transition and process covariance over `dt_s` at an acceleration density.
  static void motion(double dt_s, double density, const FingertipFilterOptions& options, Matrix6d& transition,
                     Matrix6d& noise);

 private:
  bool alive_ = false;
  TimePoint time_;
  TimePoint last_update_;
  TimePoint jerking_until_;
  double density_ = 0.0;
  Vector6d mean_ = Vector6d::Zero();
  Matrix6d covariance_ = Matrix6d::Identity();
  std::array<std::int64_t, max_cameras> seen_ns_{};  ///< Last update per camera; 0: never
};

}  // namespace handloft::tracking
