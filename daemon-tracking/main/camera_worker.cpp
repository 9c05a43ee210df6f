#include "daemon-tracking/main/camera_worker.h"

#include <utility>

namespace handloft::tracking {

CameraWorker::CameraWorker(CameraTracker tracker, Done done, Logger log, const Clock& clock, TraceLog* trace)
    : tracker_(std::move(tracker)),
      done_(std::move(done)),
      log_(std::move(log)),
      clock_(clock),
      trace_(trace),
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

void CameraWorker::add_spans(const CameraFrame& frame, TimePoint began, const VisionTimings& timings) {
  if (trace_ == nullptr) return;
  TimePoint begin = frame.arrival_time;
  const auto span = [&](TraceStage stage, Duration length) {
    trace_->add({begin, length, frame.camera, frame.sequence, stage});
    begin += length;
  };
  span(TraceStage::waiting, began - begin);
  span(TraceStage::decode, from_seconds(timings.decode_s));
  span(TraceStage::tags, from_seconds(timings.tags_s));
  span(TraceStage::fingertips, from_seconds(timings.fingertips_s));
}

void CameraWorker::run() {
  for (;;) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return finishing_ || waiting_; });
    if (!waiting_) return;
    CameraFrame frame = std::move(*waiting_);
    waiting_.reset();
    lock.unlock();
    const TimePoint began = clock_.now();
    Result<CameraObservation> observation = tracker_.process(frame);
    if (!observation) ++refused_;
    if (observation) {
      add_spans(frame, began, observation->timings);
      done_(std::move(frame), std::move(*observation));
      tracker_.finish_search();
    } else if (const auto kept_back = complaints_.allow(clock_.now())) {
      log_.warning("camera {}: frame {} can't be used: {} ({} more such)", frame.camera, frame.sequence,
                   observation.error().describe(), *kept_back);
    }
  }
}

}  // namespace handloft::tracking
