#include "client-hmd/main/report.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace handloft::client {
namespace {

nlohmann::json summary(const LatencyHistogram& histogram) {
  return {{"count", histogram.count()},
          {"median", histogram.quantile_ms(0.5)},
          {"p95", histogram.quantile_ms(0.95)},
          {"p99", histogram.quantile_ms(0.99)},
          {"longest", histogram.longest_ms()}};
}

}  // namespace

std::string report_json(const RunFigures& figures) {
  std::size_t points = 0;
  std::size_t triangles = 0;
  if (figures.scene != nullptr) {
    for (const auto& [id, entity] : figures.scene->entities) {
      points += entity->points == nullptr ? 0 : entity->points->points.size();
      triangles += entity->surface == nullptr ? 0 : entity->surface->indices.size() / 3;
    }
  }
  const std::uint64_t frames = figures.frame_time.count();
  const nlohmann::json json{
      {"offscreen", figures.offscreen},
      {"size_px", {figures.width_px, figures.height_px}},
      {"seconds", figures.seconds},
      {"frames", frames},
      {"camera_to_photon_ms", summary(figures.photons.camera_to_photon)},
      {"motion_to_photon_ms", summary(figures.photons.motion_to_photon)},
      {"light_prediction_error_ms", summary(figures.photons.prediction_error)},
      {"missed_refreshes", figures.photons.missed_refreshes},
      {"repeated_films", figures.photons.repeated_films},
      {"graphics_resets", figures.graphics_resets},
      {"frame_ms", summary(figures.frame_time)},
      {"frame_alone_ms", summary(figures.frame_time_alone)},
      {"join_ms", summary(figures.model.join_to_scene)},
      {"outage_ms", summary(figures.model.outages)},
      {"capture_to_client_ms", summary(figures.model.capture_to_receipt)},
      {"capture_to_presentation_ms", summary(figures.capture_to_presentation)},
      {"connects", figures.model.connects},
      {"reconnects", figures.model.connects > 0 ? figures.model.connects - 1 : 0},
      {"messages_applied", figures.model.mirror.applied},
      {"messages_refused", figures.model.mirror.refused + figures.model.activities_refused},
      {"stale_entities", figures.model.mirror.stale_entities},
      {"tracking_frames", figures.tracking.frames},
      {"tracking_refused", figures.tracking.refused},
      {"scene",
       {{"sequence", figures.scene == nullptr ? 0 : figures.scene->sequence},
        {"entities", figures.scene == nullptr ? 0 : figures.scene->entities.size()},
        {"points", points},
        {"triangles", triangles}}},
      {"screenshot", figures.screenshot}};
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Status write_text(const std::string& path, const std::string& text) {
  const std::string temporary = path + fmt::format(".{}.tmp", ::getpid());
  std::ofstream file(temporary, std::ios::binary);
  file << text;
  file.close();
  std::error_code failure;
  if (!file) {
    const std::string reason = std::strerror(errno);
    std::filesystem::remove(temporary, failure);
    return make_error(ErrorCode::io, fmt::format("cannot write {}: {}", path, reason));
  }
  std::filesystem::rename(temporary, path, failure);
  if (failure) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    return make_error(ErrorCode::io, fmt::format("cannot write {}: {}", path, failure.message()));
  }
  return {};
}

}  // namespace handloft::client
