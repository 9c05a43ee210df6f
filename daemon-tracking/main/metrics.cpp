#include "daemon-tracking/main/metrics.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "common/base/metrics_text.h"
#include "common/base/version.h"

namespace handloft::tracking {

namespace {

constexpr double ms_per_s = 1000.0;

void add_histogram(MetricsText& text, const LatencyHistogram& values, const std::string& labels = {}) {
  const std::string comma = labels.empty() ? "" : labels + ",";
  for (std::size_t i = 0; i < LatencyHistogram::bounds_ms.size(); ++i) {
    text.sample(values.up_to[i], fmt::format("{}le=\"{}\"", comma, LatencyHistogram::bounds_ms[i] / ms_per_s),
                "_bucket");
  }
  text.sample(values.count(), comma + "le=\"+Inf\"", "_bucket");
  text.sample(values.sum_ms / ms_per_s, labels, "_sum");
  text.sample(values.count(), labels, "_count");
}

void devices(MetricsText& text, const MetricsSnapshot& figures) {
  const auto each = [&](std::string_view name, std::string_view type, std::string_view help, auto value) {
    text.family(name, type, help);
    for (const DeviceReport& device : figures.devices)
      text.sample(value(device), metrics_label("device", device.device));
  };
  each("device_present", "gauge", "1: plugged in and delivering.",
       [](const DeviceReport& device) { return device.present ? 1 : 0; });
  each("device_rate_hz", "gauge", "Samples a second over the last interval.",
       [](const DeviceReport& device) { return device.rate_hz; });
  each("device_asked_rate_hz", "gauge", "What it was asked for; 0: as it comes.",
       [](const DeviceReport& device) { return device.asked_rate_hz; });
  each("device_samples_total", "counter", "Samples that came.",
       [](const DeviceReport& device) { return device.samples; });
  each("device_dropped_total", "counter", "Samples that the device counted, but that never came here.",
       [](const DeviceReport& device) { return device.dropped; });
  each("device_refused_total", "counter", "Samples that could not be used.",
       [](const DeviceReport& device) { return device.refused; });
  each("device_alarm", "gauge", "1: something is wrong with it; `handloft-trackd status` says what.",
       [](const DeviceReport& device) { return device.problem.empty() ? 0 : 1; });
}

void cameras(MetricsText& text, const MetricsSnapshot& figures) {
  const auto each = [&](std::string_view name, std::string_view help, auto value) {
    text.family(name, "counter", help);
    for (const CameraMetrics& camera : figures.cameras)
      text.sample(value(camera), metrics_label("camera", camera.name));
  };
  each("camera_frames_total", "Frames that the fusion took.",
       [](const CameraMetrics& camera) { return camera.frames; });
  each("camera_overtaken_total", "Frames replaced by a newer one before the vision came to them.",
       [](const CameraMetrics& camera) { return camera.dropped; });
  each("camera_tags_total", "AprilTags found.", [](const CameraMetrics& camera) { return camera.tags; });
  each("camera_fingertips_total", "Patches of a fingertip's colour found.",
       [](const CameraMetrics& camera) { return camera.fingertips; });
  text.family("camera_vision_seconds", "histogram", "Decoding and looking at one frame.");
  for (const CameraMetrics& camera : figures.cameras)
    add_histogram(text, camera.vision, metrics_label("camera", camera.name));
}

}  // namespace

void MetricsBoard::put(MetricsSnapshot snapshot) {
  const std::lock_guard lock(mutex_);
  snapshot_ = std::move(snapshot);
}

MetricsSnapshot MetricsBoard::get() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

void MetricsBoard::note_reload(bool taken) {
  const std::lock_guard lock(mutex_);
  ++(taken ? reloads_ : reloads_refused_);
}

std::uint64_t MetricsBoard::reloads() const {
  const std::lock_guard lock(mutex_);
  return reloads_;
}

std::uint64_t MetricsBoard::reloads_refused() const {
  const std::lock_guard lock(mutex_);
  return reloads_refused_;
}

std::string prometheus_text(const MetricsBoard& board, const ProcessFigures& process) {
  const MetricsSnapshot figures = board.get();
  MetricsText text;
  text.family("build_info", "gauge", "Which build this is.");
  text.sample(1, metrics_label("version", version()) + "," + metrics_label("commit", version_commit()));
  devices(text, figures);
  cameras(text, figures);
  const auto counter = [&](std::string_view name, std::string_view help, std::uint64_t value) {
    text.family(name, "counter", help);
    text.sample(value);
  };
  counter("frames_published_total", "Frames made for subscribers.", figures.published);
  counter("frames_missed_total", "Frames that slow subscribers did not get.", figures.missed_by_subscribers);
  counter("frames_refused_total", "Camera frames that could not be used.", figures.health.frames_refused);
  counter("observations_late_total", "Put in order after they came late.", figures.health.late_replayed);
  counter("observations_too_late_total", "Older than what is kept to put them in order.",
          figures.health.late_dropped);
  counter("fingertips_gated_total", "Patches that no fingertip could have made.", figures.health.tips_gated);
  counter("head_gated_total", "Tags that the head could not have shown.", figures.health.head_gated);
  counter("filter_resets_total", "Filters begun anew.", figures.health.resets);
  counter("recorded_samples_total", "Samples written to the recording.", figures.recorded_samples);
  counter("reloads_total", "Times that configuration and calibration were read again.", board.reloads());
  counter("reloads_refused_total", "Times that the files were bad and the old ones stayed.",
          board.reloads_refused());
  text.family("subscribers", "gauge", "Programs that follow.");
  text.sample(figures.subscribers);
  text.family("exposure_to_publish_seconds", "histogram",
              "Age of a frame when it is published: middle of its exposure to socket.");
  add_histogram(text, figures.exposure_to_publish);
  text.family("arrival_to_publish_seconds", "histogram", "The daemon's own part of that age.");
  add_histogram(text, figures.arrival_to_publish);
  add_process_figures(text, process);
  return text.take();
}

}  // namespace handloft::tracking
