#pragma once
// The daemon's heart as one pure object: samples in, snapshots out. For replay, feed samples in their
// recorded order (vision runs inside, single-threaded); live, run one CameraTracker per camera on its own
// thread and feed their observations and the glove's samples from one fusion thread. Either way the output is
// a function of what was fed in and in which order: two runs give the same bits (T13). Not thread-safe.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/motion_prediction.h"
#include "common/base/result.h"
#include "daemon-tracking/fusion/camera_watch.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/fusion/glove_tracker.h"
#include "daemon-tracking/fusion/hand_filter.h"
#include "daemon-tracking/fusion/head_filter.h"
#include "daemon-tracking/fusion/pen_tracker.h"
#include "daemon-tracking/fusion/space_mouse_tracker.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/sample.h"
#include "daemon-tracking/vision/camera_tracker.h"

namespace handloft::tracking {

struct PipelineOptions {
  CameraTrackerOptions camera;
  HandFilterOptions hand;
  HeadFilterOptions head;
  GloveOptions glove;
  PenOptions pen;
  SpaceMouseLimits space_mouse;
  CameraWatchOptions watch;
  PredictionLimits prediction;
  double table_height_m = 0.005;  ///< A fingertip's surface this near the table touches it (T10).
};

/// Counters since the start; none is ever reset.
struct PipelineHealth {
  std::uint64_t frames = 0;          ///< Camera frames or observations consumed
  std::uint64_t frames_refused = 0;  ///< Did not decode, wrong size, time not increasing
  std::uint64_t glove_reports = 0;
  std::uint64_t glove_refused = 0;
  GloveCounters glove;
  std::uint64_t pen_samples = 0;
  std::uint64_t pen_refused = 0;
  std::uint64_t pen_overruns = 0;  ///< The kernel lost events (SYN_DROPPED); the state was read anew
  std::uint64_t space_mouse_reports = 0;
  std::uint64_t space_mouse_refused = 0;
  std::uint64_t late_replayed = 0;  ///< Observations put in order by re-running history
  std::uint64_t late_dropped = 0;   ///< Observations older than the history
  std::uint64_t tips_gated = 0;     ///< Blobs refused by the innovation gate
  std::uint64_t head_gated = 0;
  std::uint64_t resets = 0;                 ///< Filters re-initialised
  std::string last_error;                   ///< Of the last refused sample
  std::vector<CameraPlacement> placements;  ///< One per camera: does it stand where it was calibrated (T12)?
};

class TrackingPipeline {
 public:
  /// Fails with the first error of the rig's cameras (not finite, absurd sizes) or invalid_argument for
  /// options.
  static Result<TrackingPipeline> create(const Rig& rig, const PipelineOptions& options = {});

  /// Replay: any sample. A snapshot when it was a camera frame that decoded; the glove's and presence samples
  /// change what the next snapshot says. Truth is ignored.
  std::optional<FusedState> consume(const Sample& sample);
  /// Live: what a CameraTracker made of a frame. No snapshot when the camera is unknown or the observation
  /// too late.
  std::optional<FusedState> consume(const CameraObservation& observation);
  void consume(const GloveBytes& report);
  void consume(const DeviceBytes& bytes);
  void consume(const DevicePresence& presence);

  /// A snapshot without an observation: a device came or went, or no camera delivers. Carried to `time`, or
  /// to the newest observation or tick if that is later, so that snapshots never go back in time.
  FusedState tick(TimePoint time);

  /// The state carried to `time` (not before the newest observation) with the one prediction formula.
  FusedState state_at(TimePoint time) const;

  /// A fingertip at a past or future time: exact, interpolated (smoothed by later observations), predicted or
  /// lost.
  TipAt tip_at(Finger finger, TimePoint time) const;
  HeadAt head_at(TimePoint time) const;

  PipelineHealth health() const;
  const Rig& rig() const { return rig_; }

 private:
  TrackingPipeline(const Rig& rig, const PipelineOptions& options, std::vector<CameraTracker> trackers,
                   HandFilter hand, HeadFilter head, CameraWatch watch);

  Rig rig_;
  PipelineOptions options_;
  std::vector<CameraTracker> trackers_;
  HandFilter hand_;
  HeadFilter head_;
  GloveTracker glove_;
  PenTracker pen_;
  SpaceMouseTracker space_mouse_;
  CameraWatch watch_;
  PipelineHealth health_;
  std::uint64_t sequence_ = 0;
  TimePoint newest_;
};

}  // namespace handloft::tracking
