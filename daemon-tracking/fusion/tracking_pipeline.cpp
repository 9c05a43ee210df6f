#include "daemon-tracking/fusion/tracking_pipeline.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace handloft::tracking {

namespace {
// The presence of cameras is their sources' business.
constexpr const char* glove_device = "glove";
constexpr const char* pen_device = "pen";
constexpr const char* space_mouse_device = "space_mouse";
}  // namespace

TrackingPipeline::TrackingPipeline(const Rig& rig, const PipelineOptions& options,
                                   std::vector<CameraTracker> trackers, HandFilter hand, HeadFilter head,
                                   CameraWatch watch)
    : rig_(rig),
      options_(options),
      trackers_(std::move(trackers)),
      hand_(std::move(hand)),
      head_(std::move(head)),
      glove_(options.glove),
      pen_(options.pen),
      space_mouse_(options.space_mouse),
      watch_(std::move(watch)) {}

Result<TrackingPipeline> TrackingPipeline::create(const Rig& rig, const PipelineOptions& options) {
  auto hand = HandFilter::create(rig, options.hand);
  if (!hand) return hand.error();
  auto head = HeadFilter::create(rig, options.head);
  if (!head) return head.error();
  auto watch = CameraWatch::create(rig, options.watch);
  if (!watch) return watch.error();
  std::vector<CameraTracker> trackers;
  for (std::uint32_t camera = 0; camera < rig.cameras.size(); ++camera) {
    auto tracker = CameraTracker::create(rig, camera, options.camera);
    if (!tracker) return tracker.error();
    trackers.push_back(std::move(*tracker));
  }
  return TrackingPipeline(rig, options, std::move(trackers), std::move(*hand), std::move(*head),
                          std::move(*watch));
}

std::optional<FusedState> TrackingPipeline::consume(const Sample& sample) {
  if (const auto* glove = std::get_if<GloveBytes>(&sample)) {
    consume(*glove);
    return std::nullopt;
  }
  if (const auto* presence = std::get_if<DevicePresence>(&sample)) {
    consume(*presence);
    return std::nullopt;
  }
  if (const auto* bytes = std::get_if<DeviceBytes>(&sample)) {
    consume(*bytes);
    return std::nullopt;
  }
  const auto* frame = std::get_if<CameraFrame>(&sample);
  if (frame == nullptr) return std::nullopt;
  if (frame->camera >= trackers_.size()) {
    ++health_.frames;
    ++health_.frames_refused;
    health_.last_error = "a frame of a camera that the rig lacks";
    return std::nullopt;
  }
  const auto observation = trackers_[frame->camera].process(*frame);
  if (!observation) {
    ++health_.frames;
    ++health_.frames_refused;
    health_.last_error = observation.error().describe();
    return std::nullopt;
  }
  return consume(*observation);
}

std::optional<FusedState> TrackingPipeline::consume(const CameraObservation& observation) {
  ++health_.frames;
  watch_.update(observation);
  Status status = head_.update(observation);
  if (status && rig_.cameras[observation.camera].role == CameraRole::table)
    status = hand_.update(observation);
  if (!status) {
    // A late one is counted by the filter; all else is a refused frame.
    if (status.error().code != ErrorCode::failed_precondition) ++health_.frames_refused;
    health_.last_error = status.error().describe();
    return std::nullopt;
  }
  newest_ = std::max(newest_, observation.capture_time);
  glove_.advance(newest_);
  space_mouse_.advance(newest_);
  FusedState state = state_at(newest_);
  state.sequence = ++sequence_;
  state.camera = observation.camera;
  return state;
}

void TrackingPipeline::consume(const GloveBytes& report) {
  ++health_.glove_reports;
  if (Status status = glove_.consume(report); !status) {
    ++health_.glove_refused;
    health_.last_error = status.error().describe();
  }
}

void TrackingPipeline::consume(const DeviceBytes& bytes) {
  Status status;
  std::uint64_t* refused = nullptr;
  switch (bytes.kind) {
    case DeviceData::serial_glove_line:
      ++health_.glove_reports;
      refused = &health_.glove_refused;
      status = glove_.consume(bytes);
      break;
    case DeviceData::pen_facts:
    case DeviceData::pen_events:
      ++health_.pen_samples;
      refused = &health_.pen_refused;
      status = pen_.consume(bytes);
      break;
    case DeviceData::space_mouse_report:
      ++health_.space_mouse_reports;
      refused = &health_.space_mouse_refused;
      status = space_mouse_.consume(bytes);
      break;
  }
  if (status) return;
  if (refused != nullptr) ++*refused;
  health_.last_error = status.error().describe();
}

void TrackingPipeline::consume(const DevicePresence& presence) {
  if (presence.present) return;
  if (presence.device == glove_device) glove_.device_gone(presence.time);
  if (presence.device == pen_device) pen_.device_gone(presence.time);
  if (presence.device == space_mouse_device) space_mouse_.device_gone(presence.time);
}

FusedState TrackingPipeline::tick(TimePoint time) {
  newest_ = std::max(newest_, time);
  glove_.advance(newest_);
  space_mouse_.advance(newest_);
  FusedState state = state_at(newest_);
  state.sequence = ++sequence_;
  return state;
}

FusedState TrackingPipeline::state_at(TimePoint time) const {
  FusedState state;
  state.time = time;
  state.sequence = sequence_;
  state.head = head_.head_at_time(time, options_.prediction);
  state.hand.tips = hand_.tips_at(time, options_.prediction);
  glove_.describe(state.hand);
  pen_.describe(state.pen);
  space_mouse_.describe(state.space_mouse);
  for (const FusedTip& tip : state.hand.tips)
    if (tip.state == TrackingState::tracked || tip.state == TrackingState::single)
      state.hand.table_by_height = state.hand.table_by_height ||
                                   tip.position_m.z() - rig_.fingertip_radius_m < options_.table_height_m;
  return state;
}

TipAt TrackingPipeline::tip_at(Finger finger, TimePoint time) const {
  return hand_.at(finger, time, options_.prediction);
}

HeadAt TrackingPipeline::head_at(TimePoint time) const {
  return head_.at(time, options_.prediction);
}

PipelineHealth TrackingPipeline::health() const {
  PipelineHealth out = health_;
  out.glove = glove_.counters();
  out.pen_overruns = pen_.overruns();
  const auto hand = hand_.counters();
  const auto head = head_.counters();
  out.placements = watch_.placements();
  out.late_replayed = std::max(hand.replayed, head.replayed);
  out.late_dropped = std::max(hand.dropped, head.dropped);
  out.tips_gated = hand.gated;
  out.head_gated = head.gated;
  out.resets = hand.resets + head.resets;
  return out;
}

}  // namespace handloft::tracking
