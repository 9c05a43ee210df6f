#pragma once
// One camera's vision on a thread of its own (tracking.md 5.2): looks at the newest frame, never at a queue
// of old ones.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "common/base/log.h"
#include "daemon-tracking/main/sequence_gaps.h"
#include "daemon-tracking/main/trace_log.h"
#include "daemon-tracking/source/sample.h"
#include "daemon-tracking/vision/camera_tracker.h"

namespace handloft::tracking {

class CameraWorker {
 public:
  using Done = std::function<void(CameraFrame, CameraObservation)>;

  /// `done` is called on the worker's thread for each frame that decoded.
  /// `trace` may be null.
  CameraWorker(CameraTracker tracker, Done done, Logger log, const Clock& clock, TraceLog* trace = nullptr);
  ~CameraWorker();
  CameraWorker(const CameraWorker&) = delete;
  CameraWorker& operator=(const CameraWorker&) = delete;

  /// Replaces a frame that still waits. Never blocks.
  void offer(CameraFrame frame);
  /// Ends after the frame in hand and the one that waits.
  void finish();
  std::uint64_t dropped() const { return dropped_.load(); }
  /// Pictures that could not be read.
  std::uint64_t refused() const { return refused_.load(); }
  /// Frames missing in the camera's own counter.
  std::uint64_t missing() const;

 private:
  void run();
  void add_spans(const CameraFrame& frame, TimePoint began, const VisionTimings& timings);

  CameraTracker tracker_;
  Done done_;
  Logger log_;
  const Clock& clock_;
  TraceLog* trace_;
  RateLimit complaints_{std::chrono::seconds(1)};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<CameraFrame> waiting_;
  SequenceGaps gaps_;
  bool finishing_ = false;
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> refused_{0};
  std::thread thread_;
};

}  // namespace handloft::tracking
