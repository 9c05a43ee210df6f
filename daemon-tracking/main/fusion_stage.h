#pragma once
// The stage that owns all filter state: takes observations and samples in one order, records them in that
// order, and publishes what they make. One thread at a time.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/net/frame_ring.h"
#include "daemon-tracking/fusion/tracking_pipeline.h"
#include "daemon-tracking/main/report.h"
#include "daemon-tracking/main/sample_recorder.h"
#include "daemon-tracking/main/sequence_gaps.h"
#include "daemon-tracking/publish/publisher.h"
#include "daemon-tracking/publish/tracking_message.h"
#include "daemon-tracking/source/sample.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking {

/// Frames of one camera that never came here.
struct FrameLosses {
  std::uint64_t dropped = 0;  ///< No worker came to them in time.
  std::uint64_t missing = 0;  ///< The camera counted, but never delivered them.
};

/// Latencies only mean something when samples carry the present time.
enum class TimeLine { present, past };

class FusionStage {
 public:
  /// `recorder` and `ring` may be null. All must outlive the stage.
  FusionStage(TrackingPipeline pipeline, Publisher& publisher, SampleRecorder* recorder,
              net::FrameRingWriter* ring, const Clock& clock, TimeLine time_line);

  /// What is no frame: reports, presence, truth.
  void consume(const Sample& sample);
  /// A frame that has been looked at.
  void consume(const CameraFrame& frame, const CameraObservation& observation);

  /// Tells subscribers that nothing follows.
  void publish_end();

  /// `losses[i]`: of camera i.
  SessionFigures figures(const std::vector<FrameLosses>& losses) const;

 private:
  struct DeviceState {
    DeviceReport report;
    std::uint64_t samples_at_last_report = 0;
  };

  void note_frame(const CameraFrame& frame);
  void note_device(const std::string& device, TimePoint time);
  void publish(const FusedState& state, const CameraFrame& frame);
  void update_shown(const CameraFrame& frame);
  std::vector<DeviceReport> device_reports(TimePoint now);

  TrackingPipeline pipeline_;
  Publisher& publisher_;
  SampleRecorder* recorder_;
  net::FrameRingWriter* ring_;
  const Clock& clock_;
  TimeLine time_line_;

  AccuracyMeter accuracy_;
  SessionFigures figures_;
  std::vector<SequenceGaps> gaps_;
  std::vector<ShownFrame> shown_;
  std::map<std::string, DeviceState> devices_;
  std::optional<TimePoint> standing_told_;  // When a frame last carried what hardly changes.
  std::optional<FusedState> last_state_;
  v1::TrackingFrame message_;
};

}  // namespace handloft::tracking
