#pragma once
// The five fingertips in space (T6, T7): per finger an extended Kalman filter over position and damped
// velocity, updated by each camera's blobs at that camera's own capture time. Cameras run freely: pairing the
// newest frame of each costs 2 to 3 mm on a moving hand, so it is never done; a finger is first placed by
// bringing two cameras' 2D tracks to one time. Observations that come late by up to the history are put in
// order by re-running it. One thread; deterministic.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "common/base/motion_prediction.h"
#include "common/base/result.h"
#include "daemon-tracking/fusion/fingertip_filter.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/fusion/replay_history.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/camera_model.h"
#include "daemon-tracking/vision/observation.h"
#include "daemon-tracking/vision/triangulation.h"

namespace handloft::tracking {

struct HandFilterOptions {
  FingertipFilterOptions tip;
  TriangulationOptions triangulation;
  Duration tracked_within = std::chrono::milliseconds(100);    ///< Two cameras within this: tracked.
  Duration predicted_within = std::chrono::milliseconds(150);  ///< Unseen for longer: lost.
  Duration history = std::chrono::milliseconds(400);           ///< Kept for late observations and smoothing.
  Duration latest_late =
      std::chrono::milliseconds(40);  ///< Later than one frame at 30 fps (and jitter): dropped.
  double gate_nis =
      18.0;  ///< chi^2 of 2 degrees of freedom at 1e-4: a real jump is rare, a wrong blob is not.
  double miss_cost = 12.0;  ///< Of a finger without a blob in the assignment (half a gate plus colour doubt).
  double colour_weight = 1.0;  ///< Of -log colour likelihood against half the Mahalanobis distance.
  int gated_before_reset = 5;  ///< Running refusals after which a finger is placed anew.
  int swap_frames = 3;  ///< Running frames a swapped pair of labels must explain better before it is swapped.
  double swap_margin = 4.0;  ///< By how much (in cost) it must explain better.
  double unplaced_cost =
      4.0;  ///< Of a blob for a finger that has no place yet: half of a blob's plausible surprise.
  /// A blob is a cap's visible part. A whole cap's blob covers this share of its image (the rim's mixed
  /// colours do not count), and the centre of one of which the share v shows is off by about this many radii
  /// times (1 - v)^2: measured on the rendered rig.
  double whole_share = 0.9;
  double hidden_bias = 0.45;
  /// A fingertip that is known worse than this (one camera alone sees it: nothing tells its depth) is taken
  /// to move as the nearest one that is known better, to so many m/s.
  double unsure_sigma_m = 0.003;
  double hand_velocity_sigma = 0.05;
  Duration sight_span =
      std::chrono::milliseconds(80);  ///< Longest gap over which a 2D track is interpolated.
  double min_tip_distance_m =
      0.008;  ///< Two fingertips nearer than this are one: the less sure one is dropped.
  double model_sigma_px =
      0.15;  ///< Added to every blob: calibration and blob bias that no covariance knows of.
};

/// A fingertip at a time that was asked for.
struct TipAt {
  ResultKind kind = ResultKind::lost;
  Eigen::Vector3d position_m{0, 0, 0};
  Eigen::Vector3d velocity_m_s{0, 0, 0};
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
};

class HandFilter {
 public:
  struct Counters {
    std::uint64_t updates = 0, gated = 0, resets = 0, replayed = 0, dropped = 0, swaps = 0;
  };

  /// Fails with the error of the first camera that has no valid model.
  static Result<HandFilter> create(const Rig& rig, const HandFilterOptions& options = {});

  /// Takes a table camera's blobs. Errors: not_found for a camera the rig lacks, unsupported for a head
  /// camera, failed_precondition for one later than `latest_late` (counted and dropped).
  Status update(const CameraObservation& observation);

  /// At the newest observation's time.
  std::array<FusedTip, finger_count> tips() const;
  /// Carried to `time` by prediction (T8); states age with it.
  std::array<FusedTip, finger_count> tips_at(TimePoint time, const PredictionLimits& limits) const;
  /// In the past: smoothed over the observations around it (Rauch, Tung and Striebel 1965), lost before the
  /// history.
  TipAt at(Finger finger, TimePoint time, const PredictionLimits& limits) const;

  TimePoint newest() const { return newest_; }
  Counters counters() const;
  void reset();

 private:
  struct Camera {
    CameraModel model;
    CameraCalibration calibration;
  };
  /// A camera's last sights of a finger in 2D, for placing it before there is a filter.
  struct Sight {
    bool seen = false;
    TimePoint time;
    Eigen::Vector2d pixel{0, 0};
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
  };
  struct Measurement {
    std::uint32_t camera = 0;
    TimePoint time;
    std::vector<FingertipBlob> blobs;
  };
  struct State {
    std::array<FingertipFilter, finger_count> tips;
    std::array<std::vector<std::array<Sight, 2>>, finger_count> sights;  ///< [finger][camera]{newest, before}
    std::array<std::array<int, finger_count>, finger_count> swap_votes{};
    TimePoint time;
    Counters counters;  ///< As of this state: what was replayed is counted once
  };

  HandFilter(std::vector<Camera> cameras, double tip_radius_m, const HandFilterOptions& options);
  void apply(State& state, const Measurement& measurement) const;
  void associate(State& state, const Measurement& measurement,
                 std::array<int, finger_count>& blob_of_finger) const;
  void remember_sights(State& state, const Measurement& measurement,
                       const std::array<int, finger_count>& blob_of_finger) const;
  Eigen::Matrix2d blob_covariance(const FingertipFilter& tip, const FingertipBlob& blob,
                                  const Camera& camera) const;
  double colour_cost(const FingertipBlob& blob, int finger) const;
  void place_finger(State& state, int finger, const Measurement& measurement) const;
  void repair_labels(State& state, const Measurement& measurement,
                     const std::array<int, finger_count>& blob_of_finger) const;
  void drop_merged(State& state) const;
  void move_unsure_with_hand(State& state) const;
  FusedTip describe(const FingertipFilter& tip, TimePoint time, const PredictionLimits& limits) const;

  std::vector<Camera> cameras_;
  double tip_radius_m_;
  HandFilterOptions options_;
  State initial_;
  ReplayHistory<State, Measurement> history_;
  TimePoint newest_;
  std::uint64_t replayed_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace handloft::tracking
