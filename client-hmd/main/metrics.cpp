#include "client-hmd/main/metrics.h"

#include <array>
#include <utility>

#include "common/base/metrics_text.h"
#include "common/base/version.h"

namespace handloft::client {

namespace {

constexpr double ms_per_s = 1000.0;

void add_summary(MetricsText& text, std::string_view name, std::string_view help,
                 const LatencyHistogram& values) {
  text.family(name, "summary", help);
  for (const std::string_view share : {"0.5", "0.95", "0.99"})
    text.sample(values.quantile_ms(std::stod(std::string(share))) / ms_per_s,
                metrics_label("quantile", share));
  text.sample(values.count(), {}, "_count");
}

}  // namespace

std::string prometheus_text(const RunFigures& figures) {
  MetricsText text;
  text.family("build_info", "gauge", "Which build this is.");
  text.sample(1, metrics_label("version", version()) + "," + metrics_label("commit", version_commit()));
  const auto counter = [&](std::string_view name, std::string_view help, std::uint64_t value) {
    text.family(name, "counter", help);
    text.sample(value);
  };
  add_summary(text, "frame_seconds", "From the start of a frame to its being drawn.", figures.frame_time);
  add_summary(text, "camera_to_photon_seconds", "From the film's exposure to light, estimated.",
              figures.photons.camera_to_photon);
  add_summary(text, "motion_to_photon_seconds",
              "From the newest measurement of head or hand to light, estimated.",
              figures.photons.motion_to_photon);
  add_summary(text, "light_prediction_error_seconds", "Of the time of light, whichever way.",
              figures.photons.prediction_error);
  add_summary(text, "capture_to_client_seconds", "From the exposure that shaped a scene to its receipt.",
              figures.model.capture_to_receipt);
  add_summary(text, "capture_to_presentation_seconds",
              "From that exposure to the frame that first shows the scene.", figures.capture_to_presentation);
  counter("frames_total", "Frames drawn.", figures.frame_time.count());
  counter("frames_skipped_total", "Not drawn, because nothing could be seen.", figures.photons.skipped);
  counter("missed_refreshes_total", "Frames that came after the refresh they were drawn for.",
          figures.photons.missed_refreshes);
  counter("repeated_films_total", "Frames that showed the same film as the one before.",
          figures.photons.repeated_films);
  counter("graphics_resets_total", "Resets of the graphics card, survived.", figures.graphics_resets);
  counter("model_connects_total", "Handshakes with the model server.", figures.model.connects);
  counter("tracking_connects_total", "Handshakes with the tracking daemon.", figures.tracking.connects);
  counter("tracking_frames_total", "Tracking frames received.", figures.tracking.frames);
  counter("tracking_refused_total", "Tracking frames, or parts of them, that could not be used.",
          figures.tracking.refused);
  text.family("scene_entities", "gauge", "Shapes, references and models shown.");
  text.sample(figures.scene == nullptr ? std::size_t{0} : figures.scene->entities.size());
  return text.take();
}

Result<std::unique_ptr<Metrics>> Metrics::serve(const net::Endpoint& endpoint, Logger log) {
  std::unique_ptr<Metrics> metrics(new Metrics);
  metrics->put({});
  auto server = net::MetricsServer::listen(
      metrics->io_.context().get_executor(), endpoint, "handloft-hmd",
      [raw = metrics.get()] {
        const std::lock_guard lock(raw->mutex_);
        return raw->text_;
      },
      std::move(log));
  if (!server) return server.error();
  metrics->server_ = std::move(*server);
  return metrics;
}

Metrics::~Metrics() {
  if (server_) server_->stop();
  io_.finish();
}

void Metrics::put(const RunFigures& figures) {
  std::string text = prometheus_text(figures);
  const std::lock_guard lock(mutex_);
  text_.swap(text);
}

}  // namespace handloft::client
