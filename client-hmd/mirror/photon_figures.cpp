#include "client-hmd/mirror/photon_figures.h"

#include <fmt/format.h>

namespace handloft::client {
namespace {

void add_line(std::string& text, const char* name, const LatencyHistogram& histogram) {
  if (histogram.count() == 0) return;
  text += fmt::format("{} {:.1f} ms (p95 {:.1f}, p99 {:.1f})\n", name, histogram.quantile_ms(0.5),
                      histogram.quantile_ms(0.95), histogram.quantile_ms(0.99));
}

}  // namespace

void PhotonFigures::add(const FrameTimes& times) {
  ++frames;
  if (times.missed_refresh) ++missed_refreshes;
  const TimePoint light = times.swapped + times.to_light;
  if (times.exposure) {
    camera_to_photon.add(light - *times.exposure);
    if (last_exposure == times.exposure) ++repeated_films;
  }
  last_exposure = times.exposure;
  if (times.newest_pose) motion_to_photon.add(light - *times.newest_pose);
  prediction_error.add(light > times.predicted_light ? light - times.predicted_light
                                                     : times.predicted_light - light);
}

std::string describe(const PhotonFigures& figures, const LatencyHistogram& frame_time) {
  std::string text;
  add_line(text, "camera to light", figures.camera_to_photon);
  add_line(text, "motion to light", figures.motion_to_photon);
  add_line(text, "time of light off by", figures.prediction_error);
  add_line(text, "frame", frame_time);
  text += fmt::format("{} frames, {} missed refreshes, {} repeated pictures\n", figures.frames,
                      figures.missed_refreshes, figures.repeated_films);
  return text;
}

}  // namespace handloft::client
