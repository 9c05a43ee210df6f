#pragma once
// The head's pose (T5): an iterated extended Kalman filter over position, orientation, velocity and angular
// velocity, whose measurements are tag corners in pixels: the head rig's tags seen by table cameras, and the
// table's tags seen by the camera on the head. Both kinds go in at their own capture times; no pose is
// averaged with another. A view that sees one tag almost frontally has two solutions: after the start the
// prediction decides, and a start from an ambiguous view waits for a second opinion.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "common/base/motion_prediction.h"
#include "common/base/result.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/fusion/replay_history.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/body_pose.h"
#include "daemon-tracking/vision/camera_model.h"
#include "daemon-tracking/vision/moving_body.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking {

struct HeadFilterOptions {
  BodyPoseOptions pose;
  double corner_sigma_px = 0.15;  ///< Noise of a refined corner.
  double common_sigma_px =
      0.03;  ///< Error shared by a whole view (calibration, blur): bounds what many corners claim.
  /// (m/s^2)/sqrt(Hz) and (rad/s^2)/sqrt(Hz) of a head that looks at its work, and the factor on both when a
  /// view surprises: heads rest, then turn fast.
  double acceleration_density = 0.05;
  double angular_density = 0.2;
  double jerk_factor = 25.0;
  double jerk_nis = 16.8;               ///< chi^2 of 6 degrees of freedom, 1 %.
  double velocity_decay_s = 0.5;        ///< Time constants of both velocities.
  double initial_velocity_sigma = 0.5;  ///< m/s
  double initial_angular_sigma = 2.0;   ///< rad/s
  double max_step_s = 0.1;              ///< As for fingertips.
  double gate_rms_px = 1.2;          ///< A view whose corners after the update still miss by more is refused.
  double min_ambiguity_ratio = 2.0;  ///< A start needs the second pose to be this much worse.
  double max_start_tilt_rad = 0.05;  ///< And a rotation that is known this well (1 sigma).
  int gated_before_reset = 5;
  Duration tracked_within = std::chrono::milliseconds(100);
  Duration predicted_within =
      std::chrono::milliseconds(500);  ///< A head is heavier than a finger; then lost.
  Duration history = std::chrono::milliseconds(400);
  Duration latest_late = std::chrono::milliseconds(40);
};

struct HeadAt {
  ResultKind kind = ResultKind::lost;
  Eigen::Vector3d position_m{0, 0, 0};
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

class HeadFilter {
 public:
  struct Counters {
    std::uint64_t updates = 0, gated = 0, resets = 0, replayed = 0, dropped = 0;
  };

  static Result<HeadFilter> create(const Rig& rig, const HeadFilterOptions& options = {});

  /// Takes any camera's tags. Errors as HandFilter::update; no tags of ours is no error.
  Status update(const CameraObservation& observation);

  FusedHead head() const { return head_at_time(newest_, PredictionLimits{}); }
  FusedHead head_at_time(TimePoint time, const PredictionLimits& limits) const;
  HeadAt at(TimePoint time, const PredictionLimits& limits) const;

  TimePoint newest() const { return newest_; }
  Counters counters() const;
  void reset();

 private:
  struct Camera {
    CameraModel model;
    CameraCalibration calibration;
    Eigen::Isometry3d carrier_from_camera;  ///< In the world (table camera) or in the head's frame
  };
  struct Measurement {
    std::uint32_t camera = 0;
    TimePoint time;
    BodyView
        view;  ///< Of the head rig (table camera) or of the table (head camera); base is the camera itself
  };
  struct State {
    bool alive = false;
    TimePoint time;
    TimePoint last_update;
    Eigen::Vector3d position{0, 0, 0};
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    Eigen::Vector3d velocity{0, 0, 0};
    Eigen::Vector3d angular_velocity{0, 0, 0};
    Matrix12d covariance = Matrix12d::Identity();
    std::array<std::int64_t, 16> seen_ns{};
    int gated_running = 0;
    double rms_px = 0.0;
    std::uint32_t tags = 0;
    Counters counters;
  };

  HeadFilter(std::vector<Camera> cameras, const Rig& rig, const HeadFilterOptions& options);
  void apply(State& state, const Measurement& measurement) const;
  void predict(State& state, TimePoint time, double density_factor) const;
  bool start(State& state, const Measurement& measurement) const;
  /// How well a view went in.
  enum class Correction { accepted, surprising, refused };
  Correction correct(State& state, const Measurement& measurement, double density_factor) const;

  std::vector<Camera> cameras_;
  std::vector<TagPlacement> head_tags_;
  std::vector<TagPlacement> table_tags_;
  HeadFilterOptions options_;
  ReplayHistory<State, Measurement> history_;
  TimePoint newest_;
  std::uint64_t replayed_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace handloft::tracking
