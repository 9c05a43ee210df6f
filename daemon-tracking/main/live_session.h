#pragma once
// A session in real time (tracking.md 5.2): every source delivers on its own thread, a worker a camera looks
// at its newest frame, one fusion thread owns all filter state. A source that fails, ends or loses its device
// never ends the session; the session ends when all sources have, or when it is told to.

#include <memory>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "daemon-tracking/main/fusion_stage.h"
#include "daemon-tracking/main/session_control.h"
#include "daemon-tracking/source/sample_source.h"
#include "daemon-tracking/vision/camera_tracker.h"

namespace handloft::tracking {

class CameraWorker;

class LiveSession {
 public:
  /// `trackers[i]` looks at camera i's frames; `trace` may be null. What is referred to must outlive it.
  LiveSession(std::vector<SampleSource*> sources, std::vector<CameraTracker> trackers, const Clock& clock,
              Logger log, TraceLog* trace);
  ~LiveSession();
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  /// Frames lost so far, one entry a camera. Any thread.
  std::vector<FrameLosses> losses() const;

  /// Runs until `control` says stop or reload, or until the sources are at their end
  /// (SessionControl::note_end, which whoever made the sources has them call). Then in two phases: first no
  /// source delivers any more, then what is under way is finished, stage by stage. Once.
  SessionControl::Wake run(FusionStage& stage, const SessionControl& control,
                           const AcceptReload& accept_reload);

 private:
  std::vector<SampleSource*> sources_;
  const Clock& clock_;
  Logger log_;
  struct Queue;
  std::unique_ptr<Queue> queue_;
  RateLimit complaints_{std::chrono::seconds(1)};
  std::vector<std::unique_ptr<CameraWorker>> workers_;
};

}  // namespace handloft::tracking
