#include "daemon-tracking/main/fusion_stage.h"

#include <utility>

namespace handloft::tracking {

namespace {

constexpr double ms_per_s = 1000.0;
constexpr Duration standing_parts_interval = std::chrono::seconds(1);

net::VideoFormat to_video_format(PixelFormat format) {
  switch (format) {
    case PixelFormat::mjpeg:
      return net::VideoFormat::jpeg;
    case PixelFormat::yuyv:
      return net::VideoFormat::yuyv;
    case PixelFormat::grey:
      return net::VideoFormat::grey;
  }
  return net::VideoFormat::jpeg;
}

}  // namespace

FusionStage::FusionStage(TrackingPipeline pipeline, Publisher& publisher, SampleRecorder* recorder,
                         net::FrameRingWriter* ring, const Clock& clock, TimeLine time_line)
    : pipeline_(std::move(pipeline)),
      publisher_(publisher),
      recorder_(recorder),
      ring_(ring),
      clock_(clock),
      time_line_(time_line) {
  const std::vector<CameraCalibration>& cameras = pipeline_.rig().cameras;
  figures_.cameras.resize(cameras.size());
  gaps_.resize(cameras.size());
  shown_.resize(cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    figures_.cameras[i].name = cameras[i].name;
    shown_[i].camera = static_cast<std::uint32_t>(i);
    if (cameras[i].role == CameraRole::table) {
      shown_[i].world_from_camera = cameras[i].world_from_camera;
      shown_[i].state = TrackingState::tracked;
    }
  }
}

void FusionStage::consume(const Sample& sample) {
  if (recorder_ != nullptr) recorder_->record(sample);
  pipeline_.consume(sample);
  if (const auto* report = std::get_if<GloveBytes>(&sample)) {
    ++figures_.glove_reports;
    note_device("glove", report->arrival_time);
  } else if (const auto* presence = std::get_if<DevicePresence>(&sample)) {
    devices_[presence->device].report.present = presence->present;
  } else if (const auto* truth = std::get_if<Truth>(&sample)) {
    accuracy_.add(*truth);
  }
}

void FusionStage::consume(const CameraFrame& frame, const CameraObservation& observation) {
  if (recorder_ != nullptr) recorder_->record(frame);
  note_frame(frame);
  CameraFigures& camera = figures_.cameras.at(frame.camera);
  camera.tags += observation.tags.size();
  camera.fingertips += observation.blobs.size();
  const VisionTimings& timings = observation.timings;
  camera.vision_ms.add((timings.decode_s + timings.tags_s + timings.fingertips_s) * ms_per_s);
  if (const std::optional<FusedState> state = pipeline_.consume(observation)) publish(*state, frame);
}

void FusionStage::note_frame(const CameraFrame& frame) {
  if (frame.camera >= figures_.cameras.size()) return;
  ++figures_.cameras[frame.camera].frames;
  const std::string device = "camera/" + pipeline_.rig().cameras[frame.camera].name;
  note_device(device, frame.capture_time);
  devices_[device].report.dropped += gaps_[frame.camera].note(frame.sequence);
}

void FusionStage::note_device(const std::string& device, TimePoint time) {
  DeviceReport& report = devices_[device].report;
  ++report.samples;
  report.present = true;
  report.last_sample = time;
}

void FusionStage::publish(const FusedState& state, const CameraFrame& frame) {
  accuracy_.add(state);
  update_shown(frame);
  if (ring_ != nullptr && frame.bytes) {
    net::VideoFrameInfo info;
    info.camera = frame.camera;
    info.sequence = frame.sequence;
    info.exposure_time = frame.capture_time;
    info.format = to_video_format(frame.format);
    info.width_px = static_cast<std::uint32_t>(frame.width_px);
    info.height_px = static_cast<std::uint32_t>(frame.height_px);
    // A frame larger than a slot has no picture; its poses are published all the same.
    if (!ring_->write(info, *frame.bytes))
      ++devices_["camera/" + pipeline_.rig().cameras[frame.camera].name].report.dropped;
  }
  fill_tracking_frame(state, pipeline_.rig(), shown_, message_);
  if (!standing_told_ || state.time - *standing_told_ >= standing_parts_interval) {
    add_standing_parts(pipeline_.rig(), shown_, device_reports(state.time), message_);
  }
  publisher_.publish(message_);
  ++figures_.published;
  last_state_ = state;
  if (time_line_ == TimeLine::present) {
    const TimePoint now = clock_.now();
    figures_.capture_to_publish_ms.add(to_seconds(now - frame.capture_time) * ms_per_s);
    figures_.arrival_to_publish_ms.add(to_seconds(now - frame.arrival_time) * ms_per_s);
  }
}

void FusionStage::update_shown(const CameraFrame& frame) {
  if (frame.camera >= shown_.size()) return;
  ShownFrame& shown = shown_[frame.camera];
  shown.exposure_time = frame.capture_time;
  const CameraCalibration& camera = pipeline_.rig().cameras[frame.camera];
  if (camera.role != CameraRole::head) return;
  const HeadAt head = pipeline_.head_at(frame.capture_time);
  shown.state = head.kind == ResultKind::lost ? TrackingState::lost : TrackingState::tracked;
  Eigen::Isometry3d world_from_head = Eigen::Isometry3d::Identity();
  world_from_head.linear() = head.orientation.toRotationMatrix();
  world_from_head.translation() = head.position_m;
  shown.world_from_camera = world_from_head * camera.head_from_camera;
}

std::vector<DeviceReport> FusionStage::device_reports(TimePoint now) {
  std::vector<DeviceReport> reports;
  const double elapsed_s = standing_told_ ? to_seconds(now - *standing_told_) : 0.0;
  for (const CameraPlacement& camera : pipeline_.health().placements)
    if (camera.corners > 0) devices_["camera/" + camera.name].report.problem = placement_problem(camera);
  for (auto& [name, device] : devices_) {
    device.report.device = name;
    const auto fresh = static_cast<double>(device.report.samples - device.samples_at_last_report);
    device.report.rate_hz = elapsed_s > 0.0 ? fresh / elapsed_s : 0.0;
    device.samples_at_last_report = device.report.samples;
    reports.push_back(device.report);
  }
  standing_told_ = now;
  return reports;
}

void FusionStage::publish_end() {
  FusedState state = last_state_.value_or(FusedState{});
  ++state.sequence;
  fill_tracking_frame(state, pipeline_.rig(), shown_, message_);
  add_standing_parts(pipeline_.rig(), shown_, device_reports(state.time), message_);
  message_.set_end_of_recording(true);
  publisher_.publish(message_);
}

SessionFigures FusionStage::figures(const std::vector<FrameLosses>& losses) const {
  SessionFigures figures = figures_;
  for (std::size_t i = 0; i < figures.cameras.size() && i < losses.size(); ++i) {
    figures.cameras[i].dropped = losses[i].dropped;
    figures.cameras[i].missing = losses[i].missing;
  }
  figures.accuracy = accuracy_.accuracy();
  figures.health = pipeline_.health();
  figures.missed_by_subscribers = publisher_.frames_missed();
  if (recorder_ != nullptr) figures.recorded_samples = recorder_->sample_count();
  return figures;
}

}  // namespace handloft::tracking
