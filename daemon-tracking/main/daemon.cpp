#include "daemon-tracking/main/daemon.h"

#include <fmt/format.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "common/net/endpoint.h"
#include "common/net/frame_ring.h"
#include "daemon-tracking/main/bounded_queue.h"
#include "daemon-tracking/main/camera_worker.h"
#include "daemon-tracking/main/fusion_stage.h"
#include "daemon-tracking/main/sample_recorder.h"
#include "daemon-tracking/main/sources.h"
#include "daemon-tracking/publish/publisher.h"
#include "daemon-tracking/source/paced_source.h"

namespace handloft::tracking {

namespace {

using namespace std::chrono_literals;

constexpr auto poll_interval = 50ms;            // How soon a requested stop is seen.
constexpr double latest_frame_intervals = 0.5;  // A simulated frame that is later is dropped.
constexpr TimePoint fast_simulation_start = from_ns(1'000'000'000);  // Any fixed time but "none".
constexpr std::size_t fusion_queue_samples = 1024;                   // A second of everything.
constexpr auto slow_reader_timeout = 30s;

// Asio on a thread of its own, ended and joined with the object.
class IoThread {
 public:
  IoThread() : work_(context_.get_executor()), thread_([this] { context_.run(); }) {}
  ~IoThread() { finish(); }
  IoThread(const IoThread&) = delete;
  IoThread& operator=(const IoThread&) = delete;
  boost::asio::io_context& context() { return context_; }
  // Lets what is under way end, for a moment, then ends.
  void finish() {
    if (!thread_.joinable()) return;
    work_.reset();
    const auto deadline = std::chrono::steady_clock::now() + 1500ms;
    while (!context_.stopped() && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
    context_.stop();
    thread_.join();
  }

 private:
  boost::asio::io_context context_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  std::thread thread_;
};

struct Fused {
  CameraFrame frame;
  CameraObservation observation;
};
using FusionInput = std::variant<Sample, Fused>;

Result<std::vector<CameraTracker>> make_trackers(const Rig& rig, const Clock& clock) {
  CameraTrackerOptions options;
  options.stopwatch = &clock;
  std::vector<CameraTracker> trackers;
  for (std::uint32_t camera = 0; camera < rig.cameras.size(); ++camera) {
    Result<CameraTracker> tracker = CameraTracker::create(rig, camera, options);
    if (!tracker) return tracker.error();
    trackers.push_back(std::move(*tracker));
  }
  return trackers;
}

// Real time: vision on workers, fusion on one thread, the source on its own.
Result<std::vector<FrameLosses>> run_live(SampleSource& source, std::vector<CameraTracker> trackers,
                                          FusionStage& stage, const Clock& clock, const Logger& log,
                                          const StopRequested& stop_requested) {
  BoundedQueue<FusionInput> queue(fusion_queue_samples);
  RateLimit complaints(1s);
  const auto enqueue = [&](FusionInput input) {
    if (queue.push(std::move(input))) return;
    if (const auto kept_back = complaints.allow(clock.now())) {
      log.warning("the fusion is too slow: a sample was dropped ({} more such)", *kept_back);
    }
  };
  std::vector<std::unique_ptr<CameraWorker>> workers;
  workers.reserve(trackers.size());
  for (CameraTracker& tracker : trackers) {
    workers.push_back(std::make_unique<CameraWorker>(
        std::move(tracker),
        [&](CameraFrame frame, CameraObservation observation) {
          enqueue(Fused{std::move(frame), std::move(observation)});
        },
        log, clock));
  }
  std::thread fusion([&] {
    while (std::optional<FusionInput> input = queue.pop()) {
      if (const auto* fused = std::get_if<Fused>(&*input)) {
        stage.consume(fused->frame, fused->observation);
      } else {
        stage.consume(std::get<Sample>(*input));
      }
    }
  });
  const Status started = source.start([&](Sample sample) {
    if (auto* frame = std::get_if<CameraFrame>(&sample)) {
      if (frame->camera < workers.size()) workers[frame->camera]->offer(std::move(*frame));
    } else {
      enqueue(std::move(sample));
    }
  });
  while (started && !source.finished() && !stop_requested()) std::this_thread::sleep_for(poll_interval);

  // First nobody produces any more, then what is under way is finished, stage by stage.
  source.stop();
  std::vector<FrameLosses> losses;
  losses.reserve(workers.size());
  for (const auto& worker : workers) {
    worker->finish();
    losses.push_back({worker->dropped(), worker->missing()});
  }
  queue.close();
  fusion.join();
  if (!started) return started.error();
  return losses;
}

// As fast as it goes, on one thread, waiting for whoever wants every frame. The same trackers and the same
// stage as live, fed in the order of the stream: the same bits.
std::vector<FrameLosses> run_fast(SampleStream& stream, std::vector<CameraTracker> trackers,
                                  FusionStage& stage, Publisher& publisher, const Logger& log,
                                  const StopRequested& stop_requested) {
  std::vector<SequenceGaps> gaps(trackers.size());
  while (!stop_requested()) {
    const std::optional<Sample> sample = stream.next();
    if (!sample) break;
    const auto* frame = std::get_if<CameraFrame>(&*sample);
    if (frame == nullptr) {
      stage.consume(*sample);
      continue;
    }
    if (frame->camera >= trackers.size()) continue;
    gaps[frame->camera].note(frame->sequence);
    const Result<CameraObservation> observation = trackers[frame->camera].process(*frame);
    if (!observation) {
      log.warning("camera {}: frame {} can't be used: {}", frame->camera, frame->sequence,
                  observation.error().describe());
      continue;
    }
    stage.consume(*frame, *observation);
    publisher.wait_for_readers(slow_reader_timeout);
  }
  std::vector<FrameLosses> losses;
  losses.reserve(gaps.size());
  for (const SequenceGaps& each : gaps) losses.push_back({0, each.missing()});
  return losses;
}

Result<net::Endpoint> listening_endpoint(const DaemonOptions& options) {
  return options.listen.empty() ? net::default_tracking_endpoint() : net::parse_endpoint(options.listen);
}

bool is_fast(const DaemonOptions& options) {
  return options.pace == "fast" || (options.pace == "default" && options.replay.has_value());
}

}  // namespace

Result<Session> run_daemon(const DaemonOptions& options, const Clock& clock, const Logger& log,
                           const StopRequested& stop_requested) {
  const bool fast = is_fast(options);
  // Real time is brought to the present by a shift, once the session begins.
  Result<SourceSet> sources = open_sources(options, fast ? fast_simulation_start : TimePoint{});
  if (!sources) return sources.error();
  PipelineOptions pipeline_options;
  Result<TrackingPipeline> pipeline = TrackingPipeline::create(sources->rig, pipeline_options);
  if (!pipeline) return pipeline.error();
  Result<std::vector<CameraTracker>> trackers = make_trackers(sources->rig, clock);
  if (!trackers) return trackers.error();
  const Result<net::Endpoint> endpoint = listening_endpoint(options);
  if (!endpoint) return endpoint.error();

  IoThread io;
  Result<std::unique_ptr<Publisher>> publisher =
      Publisher::listen(io.context().get_executor(), *endpoint, clock, log.component("publish"));
  if (!publisher) return publisher.error();
  std::optional<net::FrameRingWriter> ring;
  std::unique_ptr<net::FrameRingServer> ring_server;
  if (options.video && (*publisher)->endpoint().kind == net::Endpoint::Kind::unix_socket) {
    const Result<net::Endpoint> video = net::video_endpoint((*publisher)->endpoint());
    if (!video) return video.error();
    net::FrameRingOptions ring_options;
    ring_options.slot_count = static_cast<std::uint32_t>(3 * sources->rig.cameras.size());
    Result<net::FrameRingWriter> writer = net::FrameRingWriter::create(ring_options);
    if (!writer) return writer.error();
    ring.emplace(std::move(*writer));
    auto server =
        net::FrameRingServer::listen(io.context().get_executor(), *video, ring->fd(), log.component("video"));
    if (!server) return server.error();
    ring_server = std::move(*server);
  }
  std::unique_ptr<SampleRecorder> recorder;
  if (options.record) {
    Result<std::unique_ptr<SampleRecorder>> created =
        SampleRecorder::create(*options.record, sources->description, clock, log.component("record"));
    if (!created) return created.error();
    recorder = std::move(*created);
  }
  log.info("listening on {}", (*publisher)->endpoint().to_string());

  const TimePoint give_up = clock.now() + from_seconds(options.wait_timeout_s);
  while (!stop_requested() &&
         !(*publisher)->wait_for_subscribers(options.wait_for_subscribers, poll_interval)) {
    if (clock.now() > give_up) {
      return make_error(
          ErrorCode::timeout,
          fmt::format("found {} subscribers after {} s, expected {}", (*publisher)->subscriber_count(),
                      options.wait_timeout_s, options.wait_for_subscribers),
          "wait_for_subscribers");
    }
  }

  FusionStage stage(std::move(*pipeline), **publisher, recorder.get(), ring ? &*ring : nullptr, clock,
                    fast ? TimeLine::past : TimeLine::present);
  std::vector<FrameLosses> losses;
  if (fast) {
    losses = run_fast(*sources->stream, std::move(*trackers), stage, **publisher, log, stop_requested);
  } else {
    PaceOptions pace;
    pace.start = TimeLineStart::when_prepared;
    // A busy machine must not turn into an ever older picture. A recording is played whole.
    if (!options.replay)
      pace.drop_frames_later_than = from_seconds(latest_frame_intervals / options.camera_rate_hz);
    PacedSource source("rig", std::move(sources->stream), clock, pace);
    Result<std::vector<FrameLosses>> live =
        run_live(source, std::move(*trackers), stage, clock, log, stop_requested);
    if (!live) return live.error();
    losses = std::move(*live);
  }
  stage.publish_end();
  log.info("the session has ended");
  const ReplayEnd& replay_end = *sources->replay_end;
  if (!replay_end.error && replay_end.end == record::RecordingEnd::truncated) {
    log.warning("the recording is cut off in the middle of a record, as after a crash");
  }
  while (!options.exit_at_end && !stop_requested()) std::this_thread::sleep_for(poll_interval);

  (*publisher)->drain(5s);
  Status recorded;
  if (recorder) recorded = recorder->finish();
  SessionFigures figures = stage.figures(losses);
  figures.source = sources->description;
  (*publisher)->stop();
  if (ring_server) ring_server->stop();
  io.finish();
  // Neither ended the session: all that could be tracked was, and the figures stand.
  std::optional<Error> problem = replay_end.error;
  if (!recorded) problem = recorded.error();
  if (problem) figures.problem = problem->describe();
  return Session{std::move(figures), std::move(problem)};
}

}  // namespace handloft::tracking
