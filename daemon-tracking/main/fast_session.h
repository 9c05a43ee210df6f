#pragma once
// A session on one thread from end to end: the same trackers and the same stage as live, fed in the order of
// the stream, so that the same samples give the same bits (T13). As fast as it goes, or slowed to a speed;
// either way nothing is dropped.

#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "daemon-tracking/main/fusion_stage.h"
#include "daemon-tracking/main/session_control.h"
#include "daemon-tracking/publish/publisher.h"
#include "daemon-tracking/source/sample_stream.h"
#include "daemon-tracking/vision/camera_tracker.h"

namespace handloft::tracking {

class FastSession {
 public:
  /// `speed`: times real time; 0: without waiting but for subscribers to every frame.
  FastSession(std::vector<CameraTracker> trackers, double speed, const Clock& clock, Logger log);

  /// Until the stream ends or `control` says stop or reload.
  SessionControl::Wake run(SampleStream& stream, FusionStage& stage, Publisher& publisher,
                           const SessionControl& control, const AcceptReload& accept_reload);
  std::vector<FrameLosses> losses() const;

 private:
  void consume(const Sample& sample, FusionStage& stage, Publisher& publisher, const SessionControl& control);
  SessionControl::Wake wait_until_due(const Sample& sample, const SessionControl& control);

  std::vector<CameraTracker> trackers_;
  double speed_;
  const Clock& clock_;
  Logger log_;
  RateLimit complaints_{std::chrono::seconds(1)};
  std::vector<SequenceGaps> gaps_;
  std::vector<std::uint64_t> refused_;
  std::optional<TimePoint> first_;  // On the stream's time line...
  TimePoint began_;                 // ...and when that was for us.
};

}  // namespace handloft::tracking
