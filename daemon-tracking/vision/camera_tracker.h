#pragma once
// All vision of one camera: frame in, observation out (T15: a few milliseconds at 640 x 480). Regions of
// interest come from this camera's own past frames alone, so that the observations are a function of that
// camera's frames whatever the other cameras do, and a replay gives the same bits (T13). One object per
// camera, used by one thread at a time.

#include <memory>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/sample.h"
#include "daemon-tracking/vision/fingertip_tracker.h"
#include "daemon-tracking/vision/observation.h"
#include "daemon-tracking/vision/tag_tracker.h"

namespace handloft::tracking {

struct CameraTrackerOptions {
  TagTrackerOptions tags;  ///< known_ids and standing_ids are filled from the rig
  FingertipTrackerOptions fingertips;
  const Clock* stopwatch = nullptr;  ///< For the observation's timings; outlives the tracker. None: zeros.
};

class CameraTracker {
 public:
  /// Fails with not_found when the rig has no such camera, or with the error of a part of its calibration.
  static Result<CameraTracker> create(const Rig& rig, std::uint32_t camera,
                                      const CameraTrackerOptions& options = {});

  /// Errors: invalid_argument for a frame of another camera or size, or whose time does not increase;
  /// data_corrupt for bytes that do not decode. After an error the tracker goes on with the next frame.
  Result<CameraObservation> process(const CameraFrame& frame);

  /// What is left of the last frame's work and not needed for its observation: the search for tags that came
  /// into view. The next process() does it if nobody has, so that observations depend on the frames alone;
  /// called between frames, nobody waits for it.
  void finish_search();

  std::uint32_t camera() const { return camera_; }

 private:
  CameraTracker(const CameraCalibration& calibration, std::uint32_t camera, TagTracker tags,
                FingertipTracker fingertips, const Clock* stopwatch);

  CameraCalibration calibration_;
  std::uint32_t camera_;
  FrameDecoder decoder_;
  TagTracker tags_;
  FingertipTracker fingertips_;
  const Clock* stopwatch_;
  bool started_ = false;
  TimePoint last_time_;
};

}  // namespace handloft::tracking
