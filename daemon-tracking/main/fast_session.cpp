#include "daemon-tracking/main/fast_session.h"

#include <utility>

namespace handloft::tracking {

namespace {
constexpr auto slow_reader_timeout = std::chrono::seconds(30);
}  // namespace

FastSession::FastSession(std::vector<CameraTracker> trackers, double speed, const Clock& clock, Logger log)
    : trackers_(std::move(trackers)),
      speed_(speed),
      clock_(clock),
      log_(std::move(log)),
      gaps_(trackers_.size()),
      refused_(trackers_.size()) {}

SessionControl::Wake FastSession::wait_until_due(const Sample& sample, const SessionControl& control) {
  const TimePoint time = delivery_time(sample);
  if (!first_) {
    first_ = time;
    began_ = clock_.now();
  }
  const TimePoint due = began_ + from_seconds(to_seconds(time - *first_) / speed_);
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(due - clock_.now());
  return left.count() > 0 ? control.wait(left) : SessionControl::Wake::timeout;
}

SessionControl::Wake FastSession::run(SampleStream& stream, FusionStage& stage, Publisher& publisher,
                                      const SessionControl& control, const AcceptReload& accept_reload) {
  using Wake = SessionControl::Wake;
  const auto ends = [&](Wake asked) {
    return asked == Wake::stop || (asked == Wake::reload && accept_reload());
  };
  for (;;) {
    if (const Wake asked = control.wait(std::chrono::milliseconds(0)); ends(asked)) return asked;
    const std::optional<Sample> sample = stream.next();
    if (!sample) return Wake::end;
    while (speed_ > 0.0) {
      const Wake asked = wait_until_due(*sample, control);
      if (asked == Wake::timeout) break;
      if (ends(asked)) return asked;
    }
    consume(*sample, stage, publisher, control);
  }
}

void FastSession::consume(const Sample& sample, FusionStage& stage, Publisher& publisher,
                          const SessionControl& control) {
  const auto* frame = std::get_if<CameraFrame>(&sample);
  if (frame == nullptr) return stage.consume(sample);
  if (frame->camera >= trackers_.size()) return;
  gaps_[frame->camera].note(frame->sequence);
  const Result<CameraObservation> observation = trackers_[frame->camera].process(*frame);
  if (!observation) {
    ++refused_[frame->camera];
    if (const auto kept_back = complaints_.allow(clock_.now())) {
      log_.warning("camera {}: frame {} can't be used: {} ({} more such)", frame->camera, frame->sequence,
                   observation.error().describe(), *kept_back);
    }
    return;
  }
  stage.consume(*frame, *observation);
  publisher.wait_for_readers(slow_reader_timeout, [&] { return control.stopping(); });
}

std::vector<FrameLosses> FastSession::losses() const {
  std::vector<FrameLosses> losses;
  losses.reserve(gaps_.size());
  for (std::size_t i = 0; i < gaps_.size(); ++i) losses.push_back({0, gaps_[i].missing(), refused_[i]});
  return losses;
}

}  // namespace handloft::tracking
