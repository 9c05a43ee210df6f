#include "daemon-tracking/main/report.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

namespace handloft::tracking {

namespace {

using nlohmann::json;

json percentiles(const Percentiles& values) {
  return {
      {"count", values.count()}, {"p50", values.at(0.5)}, {"p95", values.at(0.95)}, {"p99", values.at(0.99)}};
}

json error(const ErrorSummary& summary, double scale) {
  return {{"count", summary.count}, {"rms", summary.rms() * scale}, {"max", summary.largest * scale}};
}

}  // namespace

std::string to_json(const SessionFigures& figures) {
  constexpr double mm_per_m = 1000.0;
  constexpr double degrees_per_rad = 180.0 / std::numbers::pi;
  json cameras = json::array();
  for (const CameraFigures& camera : figures.cameras) {
    cameras.push_back({{"name", camera.name},
                       {"frames", camera.frames},
                       {"dropped", camera.dropped},
                       {"missing", camera.missing},
                       {"tags", camera.tags},
                       {"fingertips", camera.fingertips},
                       {"vision_ms", percentiles(camera.vision_ms)}});
  }
  json by_finger = json::array();
  for (const ErrorSummary& finger : figures.accuracy.by_finger_m)
    by_finger.push_back(error(finger, mm_per_m));
  const json document = {{"source", figures.source},
                         {"cameras", cameras},
                         {"glove_reports", figures.glove_reports},
                         {"published", figures.published},
                         {"missed_by_subscribers", figures.missed_by_subscribers},
                         {"recorded_samples", figures.recorded_samples},
                         {"problem", figures.problem},
                         {"accuracy",
                          {{"compared", figures.accuracy.compared},
                           {"fingertips_mm", error(figures.accuracy.fingertips_m, mm_per_m)},
                           {"by_finger_mm", by_finger},
                           {"fingertips_lost", figures.accuracy.fingertips_lost},
                           {"head_position_mm", error(figures.accuracy.head_position_m, mm_per_m)},
                           {"head_rotation_deg", error(figures.accuracy.head_rotation_rad, degrees_per_rad)},
                           {"heads_lost", figures.accuracy.heads_lost}}},
                         {"health",
                          {{"frames", figures.health.frames},
                           {"frames_refused", figures.health.frames_refused},
                           {"glove_refused", figures.health.glove_refused},
                           {"late_replayed", figures.health.late_replayed},
                           {"late_dropped", figures.health.late_dropped},
                           {"tips_gated", figures.health.tips_gated},
                           {"head_gated", figures.health.head_gated},
                           {"resets", figures.health.resets},
                           {"last_error", figures.health.last_error}}},
                         {"capture_to_publish_ms", percentiles(figures.capture_to_publish_ms)},
                         {"arrival_to_publish_ms", percentiles(figures.arrival_to_publish_ms)}};
  return document.dump(2);
}

Status write_report(const SessionFigures& figures, const std::filesystem::path& path) {
  std::ofstream out(path, std::ios::trunc);
  out << to_json(figures) << '\n';
  out.close();
  if (!out) {
    return make_error(ErrorCode::io, "can't write " + path.string() + ": " + std::strerror(errno), "report");
  }
  return {};
}

}  // namespace handloft::tracking
