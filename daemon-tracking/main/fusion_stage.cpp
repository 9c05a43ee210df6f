#include "daemon-tracking/main/fusion_stage.h"

#include <algorithm>
#include <utility>

#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

namespace {

constexpr double ms_per_s = 1000.0;
constexpr Duration standing_parts_interval = std::chrono::seconds(1);
// Without a camera's frame for so long, what other devices say is published on its own, at most so often.
constexpr Duration cameras_silent_after = std::chrono::milliseconds(100);
constexpr Duration tick_interval = std::chrono::milliseconds(16);
// A frame that is exposed now comes so much later at most: a tick stays behind it, since nobody wants a frame
// that is older than the one before.
constexpr Duration longest_transfer = std::chrono::milliseconds(40);

constexpr const char* glove_device = "glove";
constexpr const char* pen_device = "pen";
constexpr const char* space_mouse_device = "space_mouse";

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

const char* device_of(DeviceData kind) {
  switch (kind) {
    case DeviceData::space_mouse_report:
      return space_mouse_device;
    case DeviceData::pen_facts:
    case DeviceData::pen_events:
      return pen_device;
    case DeviceData::serial_glove_line:
      return glove_device;
  }
  return glove_device;
}

}  // namespace

FusionStage::FusionStage(TrackingPipeline pipeline, Publisher& publisher, const Clock& clock,
                         TimeLine time_line, Logger log, StageParts parts)
    : pipeline_(std::move(pipeline)),
      publisher_(publisher),
      clock_(clock),
      time_line_(time_line),
      parts_(std::move(parts)),
      devices_(std::move(log)) {
  const std::vector<CameraCalibration>& cameras = pipeline_.rig().cameras;
  figures_.cameras.resize(cameras.size());
  camera_metrics_.resize(cameras.size());
  gaps_.resize(cameras.size());
  shown_.resize(cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    figures_.cameras[i].name = camera_metrics_[i].name = cameras[i].name;
    shown_[i].camera = static_cast<std::uint32_t>(i);
    if (cameras[i].role == CameraRole::table) {
      shown_[i].world_from_camera = cameras[i].world_from_camera;
      shown_[i].state = TrackingState::tracked;
    }
  }
  message_.set_sequence(parts_.first_sequence);
  if (time_line_ == TimeLine::present && parts_.facts) {
    for (const DeviceFacts& facts : parts_.facts()) devices_.set_facts(facts);
  }
}

std::string FusionStage::camera_device(std::uint32_t camera) const {
  return "camera/" + pipeline_.rig().cameras[camera].name;
}

void FusionStage::consume(const Sample& sample) {
  if (parts_.recorder != nullptr) parts_.recorder->record(sample);
  pipeline_.consume(sample);
  const TimePoint time = delivery_time(sample);
  bool presence_changed = false, is_input = false;
  if (const auto* report = std::get_if<GloveBytes>(&sample)) {
    presence_changed = note_report(*report);
    is_input = true;
  } else if (const auto* bytes = std::get_if<DeviceBytes>(&sample)) {
    presence_changed = devices_.note_sample(device_of(bytes->kind), time, time);
    is_input = true;
  } else if (const auto* presence = std::get_if<DevicePresence>(&sample)) {
    if (presence->device == ticking_device) return publish_tick(time, Standing::when_due);
    if (presence->device == glove_device) glove_sequence_.reset();  // It counts anew.
    presence_changed = devices_.note_presence(presence->device, presence->present, time);
  } else if (const auto* truth = std::get_if<Truth>(&sample)) {
    accuracy_.add(*truth);
  }
  // Who comes and goes is told at once, with the health of all devices (T3).
  if (presence_changed) return publish_tick(time, Standing::now);
  const bool cameras_silent = !frame_arrived_ || time - *frame_arrived_ > cameras_silent_after;
  if (is_input && cameras_silent && (!ticked_ || time - *ticked_ >= tick_interval))
    publish_tick(time, Standing::when_due);
}

bool FusionStage::note_report(const GloveBytes& report) {
  ++figures_.glove_reports;
  const Result<GloveReport> parsed = parse_glove_report(report.bytes);
  if (!parsed) {
    devices_.note_refused(glove_device);
    return false;
  }
  std::uint64_t gap = 0;
  const bool counts_on = glove_sequence_ && (parsed->flags & glove_restarted) == 0;
  if (counts_on) gap = static_cast<std::uint16_t>(parsed->sequence - *glove_sequence_ - 1);
  // The counter wraps after 65,536: what looks like more than half of that is an older or repeated report.
  if (gap >= 0x8000U) gap = 0;
  glove_sequence_ = parsed->sequence;
  return devices_.note_sample(glove_device, report.arrival_time, report.arrival_time, gap);
}

void FusionStage::consume(const CameraFrame& frame, const CameraObservation& observation) {
  const TimePoint began = clock_.now();
  if (parts_.recorder != nullptr) parts_.recorder->record(frame);
  const bool presence_changed = note_frame(frame);
  CameraFigures& camera = figures_.cameras.at(frame.camera);
  camera.tags += observation.tags.size();
  camera.fingertips += observation.blobs.size();
  const VisionTimings& timings = observation.timings;
  const double vision_ms = (timings.decode_s + timings.tags_s + timings.fingertips_s) * ms_per_s;
  camera.vision_ms.add(vision_ms);
  camera_metrics_[frame.camera].vision.add(vision_ms);
  const std::optional<FusedState> state = pipeline_.consume(observation);
  const TimePoint fused = clock_.now();
  if (state) {
    frame_arrived_ = frame.arrival_time;
    publish(*state, frame, presence_changed ? Standing::now : Standing::when_due);
  } else if (presence_changed) {
    publish_tick(frame.arrival_time, Standing::now);
  }
  if (parts_.trace != nullptr && time_line_ == TimeLine::present) {
    const auto span = [&](TraceStage stage, TimePoint begin, TimePoint end) {
      parts_.trace->add({begin, end - begin, frame.camera, frame.sequence, stage});
    };
    span(TraceStage::capture, frame.capture_time, frame.arrival_time);
    span(TraceStage::fusion, began, fused);
    if (state) span(TraceStage::publish, fused, clock_.now());
  }
}

bool FusionStage::note_frame(const CameraFrame& frame) {
  if (frame.camera >= figures_.cameras.size()) return false;
  ++figures_.cameras[frame.camera].frames;
  return devices_.note_sample(camera_device(frame.camera), frame.capture_time, frame.arrival_time,
                              gaps_[frame.camera].note(frame.sequence));
}

void FusionStage::show_picture(const CameraFrame& frame) {
  if (parts_.ring == nullptr || !frame.bytes) return;
  net::VideoFrameInfo info;
  info.camera = frame.camera;
  info.sequence = frame.sequence;
  info.exposure_time = frame.capture_time;
  info.format = to_video_format(frame.format);
  info.width_px = static_cast<std::uint32_t>(frame.width_px);
  info.height_px = static_cast<std::uint32_t>(frame.height_px);
  // A frame larger than a slot has no picture; its poses are published all the same.
  if (!parts_.ring->write(info, *frame.bytes)) devices_.note_dropped(camera_device(frame.camera));
}

void FusionStage::publish(const FusedState& state, const CameraFrame& frame, Standing standing) {
  accuracy_.add(state);
  update_shown(frame);
  show_picture(frame);
  send(state, standing);
  if (time_line_ == TimeLine::present) {
    const TimePoint now = clock_.now();
    const double age_ms = to_seconds(now - frame.capture_time) * ms_per_s;
    const double own_ms = to_seconds(now - frame.arrival_time) * ms_per_s;
    figures_.capture_to_publish_ms.add(age_ms);
    figures_.arrival_to_publish_ms.add(own_ms);
    exposure_to_publish_.add(now, age_ms);
    arrival_to_publish_.add(now, own_ms);
  }
}

void FusionStage::publish_tick(TimePoint time, Standing standing) {
  ticked_ = time;
  FusedState state = pipeline_.tick(time - longest_transfer);
  if (last_state_) state.camera = last_state_->camera;
  send(state, standing);
}

void FusionStage::send(const FusedState& state, Standing standing) {
  fill_tracking_frame(state, pipeline_.rig(), shown_, message_);
  message_.set_sequence(parts_.first_sequence + state.sequence);
  if (standing == Standing::now || !standing_told_ || state.time - *standing_told_ >= standing_parts_interval)
    add_standing(state.time);
  publisher_.publish(message_);
  if (parts_.alive) parts_.alive();
  ++figures_.published;
  last_state_ = state;
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

void FusionStage::add_standing(TimePoint now) {
  // Rates need an interval of about a second; a device that comes in between closes none.
  const bool due = !standing_told_ || now - *standing_told_ >= standing_parts_interval;
  std::vector<DeviceReport> reports;
  if (due) {
    standing_told_ = now;
    for (const CameraPlacement& camera : pipeline_.health().placements)
      if (camera.corners > 0)
        devices_.set_placement_problem("camera/" + camera.name, placement_problem(camera));
    if (time_line_ == TimeLine::present && parts_.facts)
      for (const DeviceFacts& facts : parts_.facts()) devices_.set_facts(facts);
    reports = devices_.report(now);
  } else {
    reports = devices_.standing();
  }
  add_standing_parts(pipeline_.rig(), shown_, reports, message_);
  if (time_line_ == TimeLine::present) {
    const LatencyPercentiles latency = exposure_to_publish_.at(clock_.now());
    message_.mutable_latency()->set_frames(latency.frames);
    message_.mutable_latency()->set_p50_ms(latency.p50_ms);
    message_.mutable_latency()->set_p95_ms(latency.p95_ms);
    message_.mutable_latency()->set_p99_ms(latency.p99_ms);
  }
  put_metrics(std::move(reports));
}

void FusionStage::put_metrics(std::vector<DeviceReport> devices) {
  if (parts_.metrics == nullptr) return;
  MetricsSnapshot snapshot;
  snapshot.devices = std::move(devices);
  snapshot.cameras = camera_metrics_;
  const std::vector<FrameLosses> losses = parts_.losses ? parts_.losses() : std::vector<FrameLosses>{};
  for (std::size_t i = 0; i < snapshot.cameras.size(); ++i) {
    snapshot.cameras[i].frames = figures_.cameras[i].frames;
    snapshot.cameras[i].tags = figures_.cameras[i].tags;
    snapshot.cameras[i].fingertips = figures_.cameras[i].fingertips;
    if (i < losses.size()) snapshot.cameras[i].dropped = losses[i].dropped;
  }
  snapshot.published = figures_.published;
  snapshot.subscribers = publisher_.subscriber_count();
  snapshot.missed_by_subscribers = publisher_.frames_missed();
  if (parts_.recorder != nullptr) snapshot.recorded_samples = parts_.recorder->sample_count();
  snapshot.health = pipeline_.health();
  snapshot.exposure_to_publish = exposure_to_publish_.histogram();
  snapshot.arrival_to_publish = arrival_to_publish_.histogram();
  parts_.metrics->put(std::move(snapshot));
}

void FusionStage::publish_end() {
  FusedState state = last_state_.value_or(FusedState{});
  ++state.sequence;
  fill_tracking_frame(state, pipeline_.rig(), shown_, message_);
  message_.set_sequence(parts_.first_sequence + state.sequence);
  standing_told_.reset();
  add_standing(state.time);
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
  if (parts_.recorder != nullptr) figures.recorded_samples = parts_.recorder->sample_count();
  return figures;
}

}  // namespace handloft::tracking
