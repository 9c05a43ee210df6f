#include "daemon-tracking/main/live_session.h"

#include <thread>
#include <utility>
#include <variant>

#include "daemon-tracking/main/bounded_queue.h"
#include "daemon-tracking/main/camera_worker.h"

namespace handloft::tracking {

namespace {

constexpr std::size_t fusion_queue_samples = 1024;  // A second of everything.
// When nothing comes for so long, subscribers get a frame all the same: they see that the daemon is alive and
// its devices are not.
constexpr auto longest_silence = std::chrono::milliseconds(250);

struct Fused {
  CameraFrame frame;
  CameraObservation observation;
};
using FusionInput = std::variant<Sample, Fused>;

}  // namespace

struct LiveSession::Queue : BoundedQueue<FusionInput> {
  using BoundedQueue<FusionInput>::BoundedQueue;
};

LiveSession::LiveSession(std::vector<SampleSource*> sources, std::vector<CameraTracker> trackers,
                         const Clock& clock, Logger log, TraceLog* trace)
    : sources_(std::move(sources)),
      clock_(clock),
      log_(std::move(log)),
      queue_(std::make_unique<Queue>(fusion_queue_samples)) {
  workers_.reserve(trackers.size());
  for (CameraTracker& tracker : trackers) {
    workers_.push_back(std::make_unique<CameraWorker>(
        std::move(tracker),
        [this](CameraFrame frame, CameraObservation observation) {
          if (queue_->push(Fused{std::move(frame), std::move(observation)})) return;
          if (const auto kept_back = complaints_.allow(clock_.now()))
            log_.warning("the fusion is too slow: a frame was dropped ({} more such)", *kept_back);
        },
        log_, clock_, trace));
  }
}

LiveSession::~LiveSession() = default;

std::vector<FrameLosses> LiveSession::losses() const {
  std::vector<FrameLosses> losses;
  losses.reserve(workers_.size());
  for (const auto& worker : workers_)
    losses.push_back({worker->dropped(), worker->missing(), worker->refused()});
  return losses;
}

SessionControl::Wake LiveSession::run(FusionStage& stage, const SessionControl& control,
                                      const AcceptReload& accept_reload) {
  std::thread fusion([&] {
    for (;;) {
      const Popped<FusionInput> input = queue_->pop_within(longest_silence);
      if (input.state == QueueState::closed) return;
      if (input.state == QueueState::empty) {
        stage.consume(DevicePresence{clock_.now(), ticking_device, true});
        continue;
      }
      if (const auto* fused = std::get_if<Fused>(&*input.value)) {
        stage.consume(fused->frame, fused->observation);
      } else {
        stage.consume(std::get<Sample>(*input.value));
      }
    }
  });
  const SampleSink sink = [this](Sample sample) {
    if (auto* frame = std::get_if<CameraFrame>(&sample)) {
      if (frame->camera < workers_.size()) workers_[frame->camera]->offer(std::move(*frame));
      return;
    }
    if (queue_->push(std::move(sample))) return;
    if (const auto kept_back = complaints_.allow(clock_.now()))
      log_.warning("the fusion is too slow: a sample was dropped ({} more such)", *kept_back);
  };
  for (SampleSource* source : sources_) {
    // Its device may come yet, or it is missing for good: the others are followed all the same.
    if (const Status started = source->start(sink); !started)
      log_.error("{} can't be followed: {}", source->name(), started.error().describe());
  }
  SessionControl::Wake wake = control.wait();
  while (wake == SessionControl::Wake::reload && !accept_reload()) wake = control.wait();

  for (SampleSource* source : sources_) source->stop();
  for (const auto& worker : workers_) worker->finish();
  queue_->close();
  fusion.join();
  return wake;
}

}  // namespace handloft::tracking
