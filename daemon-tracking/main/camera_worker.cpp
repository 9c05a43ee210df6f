#include "daemon-tracking/main/camera_worker.h"

#include <utility>

namespace handloft::tracking {

CameraWorker::CameraWorker(CameraTracker tracker, Done done, Logger log, const Clock& clock)
    : tracker_(std::move(tracker)),
      done_(std::move(done)),
      log_(std::move(log)),
      clock_(clock),
      thread_([this] { run(); }) {}

CameraWorker::~CameraWorker() {
  finish();
}

void CameraWorker::offer(CameraFrame frame) {
  {
    const std::lock_guard lock(mutex_);
    gaps_.note(frame.sequence);
    if (waiting_) ++dropped_;
    waiting_ = std::move(frame);
  }
  changed_.notify_one();
}

std::uint64_t CameraWorker::missing() const {
  const std::lock_guard lock(mutex_);
  return gaps_.missing();
}

void CameraWorker::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void CameraWorker::run() {
  for (;;) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return finishing_ || waiting_; });
    if (!waiting_) return;
    CameraFrame frame = std::move(*waiting_);
    waiting_.reset();
    lock.unlock();
    Result<CameraObservation> observation = tracker_.process(frame);
    if (observation) {
      done_(std::move(frame), std::move(*observation));
    } else if (const auto kept_back = complaints_.allow(clock_.now())) {
      log_.warning("camera {}: frame {} can't be used: {} ({} more such)", frame.camera, frame.sequence,
                   observation.error().describe(), *kept_back);
    }
  }
}

}  // namespace handloft::tracking
