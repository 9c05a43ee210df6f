#pragma once
// The stage that owns all filter state: takes observations and samples in one order, records them in that
// order, and publishes what they make: a frame an observation, a frame when a device comes or goes, and,
// while no camera delivers, frames for what pens, 3D mice and gloves say (T14). All of it is a function of
// the samples, so that a replay publishes the same; only what is measured on the daemon's own clock (latency,
// publish time) and what drivers tell of themselves is not. One thread at a time.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/net/frame_ring.h"
#include "daemon-tracking/fusion/tracking_pipeline.h"
#include "daemon-tracking/main/device_book.h"
#include "daemon-tracking/main/latency_window.h"
#include "daemon-tracking/main/metrics.h"
#include "daemon-tracking/main/report.h"
#include "daemon-tracking/main/sample_recorder.h"
#include "daemon-tracking/main/sequence_gaps.h"
#include "daemon-tracking/main/trace_log.h"
#include "daemon-tracking/publish/publisher.h"
#include "daemon-tracking/publish/tracking_message.h"
#include "daemon-tracking/source/sample.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking {

/// Frames of one camera that never came here.
struct FrameLosses {
  std::uint64_t dropped = 0;  ///< No worker came to them in time.
  std::uint64_t missing = 0;  ///< The camera counted, but never delivered them.
  std::uint64_t refused = 0;  ///< Pictures that could not be read.
};

/// Latencies only mean something when samples carry the present time.
enum class TimeLine { present, past };

/// The presence of this device in a recording is no device's: nothing came for a while, and a frame was
/// published all the same. A replay ticks at the same moments.
inline constexpr const char* ticking_device = "clock";

/// What a stage works with beside samples; any may be null, all must outlive it.
struct StageParts {
  SampleRecorder* recorder = nullptr;
  net::FrameRingWriter* ring = nullptr;
  TraceLog* trace = nullptr;
  MetricsBoard* metrics = nullptr;
  /// Asked about once a second: what the drivers say, and what the workers lost.
  std::function<std::vector<DeviceFacts>()> facts;
  std::function<std::vector<FrameLosses>()> losses;
  std::function<void()> alive;  ///< Called with every frame that is published.
  std::uint64_t first_sequence =
      0;  ///< Frames published before, by an earlier stage for the same subscribers.
};

class FusionStage {
 public:
  FusionStage(TrackingPipeline pipeline, Publisher& publisher, const Clock& clock, TimeLine time_line,
              Logger log, StageParts parts = {});

  /// What is no frame: reports, presence, truth.
  void consume(const Sample& sample);
  /// A frame that has been looked at.
  void consume(const CameraFrame& frame, const CameraObservation& observation);

  /// Tells subscribers that nothing follows.
  void publish_end();

  /// Of the last frame published.
  std::uint64_t last_sequence() const { return message_.sequence(); }
  /// `losses[i]`: of camera i.
  SessionFigures figures(const std::vector<FrameLosses>& losses) const;

 private:
  enum class Standing { when_due, now };

  bool note_report(const GloveBytes& report);
  bool note_frame(const CameraFrame& frame);
  void publish(const FusedState& state, const CameraFrame& frame, Standing standing);
  void publish_tick(TimePoint time, Standing standing);
  void send(const FusedState& state, Standing standing);
  void show_picture(const CameraFrame& frame);
  void update_shown(const CameraFrame& frame);
  void add_standing(TimePoint now);
  void put_metrics(std::vector<DeviceReport> devices);
  std::string camera_device(std::uint32_t camera) const;

  TrackingPipeline pipeline_;
  Publisher& publisher_;
  const Clock& clock_;
  TimeLine time_line_;
  StageParts parts_;

  AccuracyMeter accuracy_;
  SessionFigures figures_;
  std::vector<CameraMetrics> camera_metrics_;
  std::vector<SequenceGaps> gaps_;
  std::optional<std::uint16_t> glove_sequence_;
  std::vector<ShownFrame> shown_;
  DeviceBook devices_;
  LatencyWindow exposure_to_publish_;
  LatencyWindow arrival_to_publish_;
  std::optional<TimePoint> standing_told_;  // When a frame last carried what hardly changes.
  std::optional<TimePoint> frame_arrived_;  // The newest camera frame that made a snapshot.
  std::optional<TimePoint> ticked_;
  std::optional<FusedState> last_state_;
  v1::TrackingFrame message_;
};

}  // namespace handloft::tracking
