#pragma once
// The daemon's figures in Prometheus' text format 0.0.4 (exposition format), and the board on which the
// session puts them about once a second for whoever asks.

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/process_figures.h"
#include "daemon-tracking/fusion/tracking_pipeline.h"
#include "daemon-tracking/main/latency_window.h"
#include "daemon-tracking/publish/tracking_message.h"

namespace handloft::tracking {

struct CameraMetrics {
  std::string name;
  std::uint64_t frames = 0;
  std::uint64_t dropped = 0;  ///< Replaced by a newer one before the vision came to it.
  std::uint64_t tags = 0;
  std::uint64_t fingertips = 0;
  LatencyHistogram vision;
};

struct MetricsSnapshot {
  std::vector<DeviceReport> devices;
  std::vector<CameraMetrics> cameras;
  std::uint64_t published = 0;
  std::uint64_t subscribers = 0;
  std::uint64_t missed_by_subscribers = 0;
  std::uint64_t recorded_samples = 0;
  PipelineHealth health;
  LatencyHistogram exposure_to_publish;
  LatencyHistogram arrival_to_publish;
};

/// Thread-safe.
class MetricsBoard {
 public:
  void put(MetricsSnapshot snapshot);
  MetricsSnapshot get() const;
  /// Files read again on request (SIGHUP), and how many were refused.
  void note_reload(bool taken);
  std::uint64_t reloads() const;
  std::uint64_t reloads_refused() const;

 private:
  mutable std::mutex mutex_;
  MetricsSnapshot snapshot_;
  std::uint64_t reloads_ = 0;
  std::uint64_t reloads_refused_ = 0;
};

std::string prometheus_text(const MetricsBoard& board, const ProcessFigures& process);

}  // namespace handloft::tracking
