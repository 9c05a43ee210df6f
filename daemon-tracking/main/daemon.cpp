#include "daemon-tracking/main/daemon.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/net/frame_ring.h"
#include "common/net/io_thread.h"
#include "common/net/metrics_server.h"
#include "daemon-tracking/main/fast_session.h"
#include "daemon-tracking/main/fusion_stage.h"
#include "daemon-tracking/main/live_session.h"
#include "daemon-tracking/main/metrics.h"
#include "daemon-tracking/main/sample_recorder.h"
#include "daemon-tracking/main/sources.h"
#include "daemon-tracking/main/trace_log.h"
#include "daemon-tracking/publish/publisher.h"
#include "daemon-tracking/source/paced_source.h"

namespace handloft::tracking {

namespace {

using namespace std::chrono_literals;
using Wake = SessionControl::Wake;

constexpr auto wait_step = 50ms;                // How soon a stop is seen while subscribers are waited for.
constexpr double latest_frame_intervals = 0.5;  // A simulated frame that is later is dropped.
constexpr TimePoint fast_simulation_start = from_ns(1'000'000'000);  // Any fixed time but "none".
constexpr auto farewell_timeout = 5s;
constexpr std::size_t ring_slots_per_camera = 3;
constexpr std::size_t fewest_ring_cameras = 6;  // A reload may bring more cameras than the start had.

bool is_fast(const DaemonOptions& options) {
  return options.pace == "fast" || (options.pace == "default" && options.replay.has_value());
}

Result<net::Endpoint> listening_endpoint(const DaemonOptions& options) {
  return options.listen.empty() ? net::default_tracking_endpoint() : net::parse_endpoint(options.listen);
}

// Checked by the publisher.
GloveOutput glove_output(const v1::GloveFeedback& feedback) {
  constexpr double full_strength = 255.0;
  constexpr std::uint32_t byte = 0xFF;
  GloveOutput output;
  output.red = static_cast<std::uint8_t>(feedback.led_rgb() >> 16U & byte);
  output.green = static_cast<std::uint8_t>(feedback.led_rgb() >> 8U & byte);
  output.blue = static_cast<std::uint8_t>(feedback.led_rgb() & byte);
  output.vibration = static_cast<std::uint8_t>(std::lround(full_strength * feedback.vibration()));
  output.vibration_ms = static_cast<std::uint16_t>(feedback.vibration_ms());
  return output;
}

// All that a session is made of, made before anything of an earlier session is given up.
struct SessionPlan {
  DaemonOptions options;
  SourceSet sources;
  std::optional<TrackingPipeline> pipeline;
  std::vector<CameraTracker> trackers;
};

Result<SessionPlan> plan_session(const DaemonOptions& options, const Clock& clock, const Logger& log) {
  SessionPlan plan;
  plan.options = options;
  // Real time is brought to the present by a shift, once the session begins.
  Result<SourceSet> sources =
      open_sources(options, is_fast(options) ? fast_simulation_start : TimePoint{}, clock, log);
  if (!sources) return sources.error();
  plan.sources = std::move(*sources);
  const Calibration& calibration = plan.sources.calibration;
  PipelineOptions pipeline_options;
  if (calibration.glove) {
    pipeline_options.glove.force_zero = calibration.glove->force_zero;
    pipeline_options.glove.force_full = calibration.glove->force_full;
  }
  Result<TrackingPipeline> pipeline = TrackingPipeline::create(calibration.rig, pipeline_options);
  if (!pipeline) return pipeline.error();
  plan.pipeline.emplace(std::move(*pipeline));
  CameraTrackerOptions tracker_options;
  tracker_options.stopwatch = &clock;
  for (std::size_t i = 0; i < calibration.rig.cameras.size(); ++i) {
    Result<CameraTracker> tracker =
        CameraTracker::create(rig_for_camera(calibration, i), static_cast<std::uint32_t>(i), tracker_options);
    if (!tracker) return tracker.error();
    plan.trackers.push_back(std::move(*tracker));
  }
  return plan;
}

class Daemon {
 public:
  Daemon(const DaemonOptions& options, const Clock& clock, const Logger& log, SessionControl& control,
         DaemonWorld world)
      : options_(options), clock_(clock), log_(log), control_(control), world_(std::move(world)) {}

  Result<Session> run() {
    Result<SessionPlan> plan = plan_session(options_, clock_, log_);
    if (!plan) return plan.error();
    if (const Status open = open_outlets(plan->sources); !open) return open.error();
    log_.info("listening on {}", publisher_->endpoint().to_string());
    tell_ready();
    if (const Status enough = await_subscribers(); !enough) return enough.error();

    for (;;) {
      const Wake wake = run_session(*plan);
      if (wake == Wake::reload) {
        plan = std::move(*next_);
        next_.reset();
        continue;
      }
      break;
    }
    return finish(*plan);
  }

 private:
  Status open_outlets(const SourceSet& sources) {
    Result<std::unique_ptr<Publisher>> publisher = open_publisher();
    if (!publisher) return publisher.error();
    publisher_ = std::move(*publisher);
    if (const Status ring = open_ring(sources.calibration.rig.cameras.size()); !ring) return ring;
    if (options_.metrics) {
      const Result<net::Endpoint> endpoint = net::parse_endpoint(*options_.metrics);
      if (!endpoint) return endpoint.error();
      auto server = net::MetricsServer::listen(
          io_.context().get_executor(), *endpoint, "handloft-trackd",
          [this] { return prometheus_text(board_, process_figures()); }, log_.component("metrics"));
      if (!server) return server.error();
      metrics_ = std::move(*server);
      log_.info("metrics at {}", metrics_->endpoint().to_string());
    }
    if (options_.trace) trace_ = std::make_unique<TraceLog>();
    if (options_.record) {
      Result<std::unique_ptr<SampleRecorder>> created =
          SampleRecorder::create(*options_.record, sources.description, clock_, log_.component("record"));
      if (!created) return created.error();
      recorder_ = std::move(*created);
    }
    return {};
  }

  Result<std::unique_ptr<Publisher>> open_publisher() {
    if (world_.listener) {
      return Publisher::serve(io_.context().get_executor(), std::move(*world_.listener), clock_,
                              log_.component("publish"));
    }
    const Result<net::Endpoint> endpoint = listening_endpoint(options_);
    if (!endpoint) return endpoint.error();
    return Publisher::listen(io_.context().get_executor(), *endpoint, clock_, log_.component("publish"));
  }

  Status open_ring(std::size_t cameras) {
    if (!options_.video || publisher_->endpoint().kind != net::Endpoint::Kind::unix_socket) return {};
    const Result<net::Endpoint> video = net::video_endpoint(publisher_->endpoint());
    if (!video) return video.error();
    net::FrameRingOptions ring_options;
    const std::size_t served = uses_devices(options_) ? std::max(cameras, fewest_ring_cameras) : cameras;
    ring_options.slot_count =
        static_cast<std::uint32_t>(ring_slots_per_camera * std::max<std::size_t>(served, 1));
    Result<net::FrameRingWriter> writer = net::FrameRingWriter::create(ring_options);
    if (!writer) return writer.error();
    ring_.emplace(std::move(*writer));
    auto server = net::FrameRingServer::listen(io_.context().get_executor(), *video, ring_->fd(),
                                               log_.component("video"));
    if (!server) return server.error();
    ring_server_ = std::move(*server);
    return {};
  }

  void tell_ready() {
    if (world_.service == nullptr) return;
    world_.service->ready(fmt::format("Listening on {}", publisher_->endpoint().to_string()));
  }

  void alive() {
    if (world_.service != nullptr) world_.service->alive();
  }

  Status await_subscribers() {
    const TimePoint give_up = clock_.now() + from_seconds(options_.wait_timeout_s);
    while (!control_.stopping() &&
           !publisher_->wait_for_subscribers(options_.wait_for_subscribers, wait_step)) {
      alive();
      if (clock_.now() > give_up) {
        return make_error(
            ErrorCode::timeout,
            fmt::format("found {} subscribers after {} s, expected {}", publisher_->subscriber_count(),
                        options_.wait_timeout_s, options_.wait_for_subscribers),
            "wait_for_subscribers");
      }
    }
    return {};
  }

  StageParts stage_parts(const SessionPlan& plan, const std::function<std::vector<FrameLosses>()>& losses) {
    StageParts parts;
    parts.recorder = recorder_.get();
    parts.ring = ring_ ? &*ring_ : nullptr;
    parts.trace = trace_.get();
    parts.metrics = &board_;
    parts.first_sequence = last_sequence_;
    parts.losses = losses;
    parts.alive = [this] { alive(); };
    DeviceSources* devices = plan.sources.devices.get();
    if (devices != nullptr) {
      parts.facts = [devices, losses, rig = plan.sources.calibration.rig] {
        std::vector<DeviceFacts> facts = devices->facts();
        const std::vector<FrameLosses> lost = losses();
        for (DeviceFacts& fact : facts)
          for (std::size_t i = 0; i < rig.cameras.size() && i < lost.size(); ++i)
            if (fact.device == "camera/" + rig.cameras[i].name) fact.refused += lost[i].refused;
        return facts;
      };
    }
    return parts;
  }

  // Runs one session to its end, its last frame included; gathers the figures.
  Wake run_session(SessionPlan& plan) {
    camera_names_.clear();
    for (const CameraCalibration& camera : plan.sources.calibration.rig.cameras)
      camera_names_.push_back(camera.name);
    control_.begin();
    const bool fast = is_fast(plan.options);
    const AcceptReload accept_reload = [this] { return plan_next(); };
    Wake wake = Wake::end;
    // They outlive the stage, which asks them to its last frame.
    std::optional<FastSession> in_order;
    std::unique_ptr<PacedSource> paced;
    std::unique_ptr<LiveSession> live;
    const auto losses = [&] { return in_order ? in_order->losses() : live->losses(); };
    if (fast) {
      in_order.emplace(std::move(plan.trackers), plan.options.speed, clock_, log_);
    } else {
      paced = pace(plan);
      std::vector<SampleSource*> sources;
      if (paced) sources.push_back(paced.get());
      if (plan.sources.devices) sources = plan.sources.devices->sources();
      live = std::make_unique<LiveSession>(std::move(sources), std::move(plan.trackers), clock_, log_,
                                           trace_.get());
    }
    FusionStage stage(std::move(*plan.pipeline), *publisher_, clock_,
                      fast ? TimeLine::past : TimeLine::present, log_.component("devices"),
                      stage_parts(plan, losses));
    if (fast) {
      wake = in_order->run(*plan.sources.stream, stage, *publisher_, control_, accept_reload);
    } else {
      show_feedback_on(plan.sources.devices.get());
      wake = live->run(stage, control_, accept_reload);
      show_feedback_on(nullptr);
    }
    if (wake != Wake::reload) stage.publish_end();
    last_sequence_ = stage.last_sequence();
    figures_ = stage.figures(losses());
    figures_.source = plan.sources.description;
    figures_.source.erase("calibration");  // The whole file's text.
    return wake;
  }

  // What subscribers want the glove's wearer to feel and see goes to the glove there is; null: to none.
  void show_feedback_on(DeviceSources* devices) {
    if (devices == nullptr) return publisher_->on_glove_feedback({});
    publisher_->on_glove_feedback(
        [devices](const v1::GloveFeedback& feedback) { devices->show(glove_output(feedback)); });
  }

  std::unique_ptr<PacedSource> pace(SessionPlan& plan) {
    if (!plan.sources.stream) return nullptr;
    PaceOptions pace;
    pace.start = TimeLineStart::when_prepared;
    // A busy machine must not turn into an ever older picture. A recording is played whole.
    if (!plan.options.replay)
      pace.drop_frames_later_than = from_seconds(latest_frame_intervals / plan.options.camera_rate_hz);
    pace.on_end = [this] { control_.note_end(); };
    return std::make_unique<PacedSource>("rig", std::move(plan.sources.stream), clock_, pace);
  }

  // Plans the next session by what the files now say. False, and told: they can't be used.
  bool plan_next() {
    (void)control_.take_reload();
    if (world_.service != nullptr) world_.service->reloading("Reading configuration and calibration again");
    Result<SessionPlan> plan = try_plan();
    board_.note_reload(plan.ok());
    if (plan) {
      log_.info("configuration and calibration were read again");
      next_.emplace(std::move(*plan));
    } else {
      log_.error("what was read before stays: {}", plan.error().describe());
    }
    tell_ready();
    return plan.ok();
  }

  Result<SessionPlan> try_plan() {
    if (recorder_) {
      return make_error(ErrorCode::failed_precondition,
                        "a recording has one calibration from its beginning to its end; end it first",
                        "record");
    }
    DaemonOptions wanted = options_;
    if (world_.read_options) {
      Result<DaemonOptions> read = world_.read_options();
      if (!read) return read.error();
      wanted = std::move(*read);
      const std::string differs = fixed_option_that_differs(options_, wanted);
      if (!differs.empty()) {
        return make_error(ErrorCode::failed_precondition, "it can't change while the daemon runs; restart it",
                          differs);
      }
    }
    return plan_session(wanted, clock_, log_);
  }

  // Nothing follows; who comes now still gets the last frame, until we are told to end.
  void await_end(const DaemonOptions& options) {
    while (!options.exit_at_end && !control_.stopping()) {
      alive();
      const auto interval = world_.service != nullptr ? world_.service->watchdog_interval() : std::nullopt;
      if (control_.wait_for_request(interval) == Wake::reload) (void)control_.take_reload();
    }
  }

  Result<Session> finish(const SessionPlan& plan) {
    log_.info("the session has ended");
    const ReplayEnd& replay_end = *plan.sources.replay_end;
    if (!replay_end.error && replay_end.end == record::RecordingEnd::truncated)
      log_.warning("the recording is cut off in the middle of a record, as after a crash");
    await_end(plan.options);
    if (world_.service != nullptr) world_.service->stopping();
    publisher_->drain(farewell_timeout);
    Status recorded;
    if (recorder_) {
      recorded = recorder_->finish();
      figures_.recorded_samples = recorder_->sample_count();
    }
    figures_.missed_by_subscribers = publisher_->frames_missed();
    publisher_->stop();
    if (ring_server_) ring_server_->stop();
    if (metrics_) metrics_->stop();
    io_.finish();
    // None of these ended the session: all that could be tracked was, and the figures stand.
    std::optional<Error> problem = replay_end.error;
    if (!recorded) problem = recorded.error();
    if (trace_) {
      if (const Status written = trace_->write(*options_.trace, camera_names_); !written)
        problem = written.error();
    }
    if (problem) figures_.problem = problem->describe();
    return Session{std::move(figures_), std::move(problem)};
  }

  const DaemonOptions options_;
  const Clock& clock_;
  const Logger& log_;
  SessionControl& control_;
  DaemonWorld world_;
  net::IoThread io_;
  MetricsBoard board_;
  std::unique_ptr<Publisher> publisher_;
  std::optional<net::FrameRingWriter> ring_;
  std::unique_ptr<net::FrameRingServer> ring_server_;
  std::unique_ptr<net::MetricsServer> metrics_;
  std::unique_ptr<TraceLog> trace_;
  std::unique_ptr<SampleRecorder> recorder_;
  std::vector<std::string> camera_names_;
  std::optional<SessionPlan> next_;  // Read again, and to be run when the session has ended.
  std::uint64_t last_sequence_ = 0;
  SessionFigures figures_;
};

}  // namespace

std::string fixed_option_that_differs(const DaemonOptions& running, const DaemonOptions& wanted) {
  if (running.listen != wanted.listen) return "listen";
  if (running.metrics != wanted.metrics) return "metrics";
  if (running.record != wanted.record) return "record";
  if (running.trace != wanted.trace) return "trace";
  if (running.video != wanted.video) return "video";
  if (running.replay != wanted.replay) return "replay";
  return {};
}

Result<Session> run_daemon(const DaemonOptions& options, const Clock& clock, const Logger& log,
                           SessionControl& control, DaemonWorld world) {
  Daemon daemon(options, clock, log, control, std::move(world));
  return daemon.run();
}

}  // namespace handloft::tracking
