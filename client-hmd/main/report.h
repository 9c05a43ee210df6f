#pragma once
// The figures of a run, as JSON for people and for the demonstration's summary.

#include <string>

#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/mirror/photon_figures.h"
#include "client-hmd/view/tracking_feed.h"
#include "common/base/result.h"

namespace handloft::client {

struct RunFigures {
  bool offscreen = false;
  int width_px = 0;
  int height_px = 0;
  double seconds = 0.0;
  std::uint64_t graphics_resets = 0;  ///< Of the card, survived.
  LatencyHistogram frame_time;        ///< From the start of a frame to its being drawn.
  /// Of those, the ones that were drawn while the model server was gone, after there had been a scene.
  LatencyHistogram frame_time_alone;
  LatencyHistogram
      capture_to_presentation;  ///< From the exposure that shaped the scene to the frame that first shows it.
  PhotonFigures photons;        ///< Estimated; see photon_figures.h.
  ModelFeedStatistics model;
  TrackingStatus tracking;
  std::shared_ptr<const Scene> scene;
  std::string screenshot;
};

/// Durations in milliseconds: "frame_ms", "capture_to_client_ms" (at receipt) and
/// "capture_to_presentation_ms" with "count", "median", "p99", "longest"; of the frames without a server
/// "frame_alone_ms", of the server's absences "outage_ms", and "join_ms" from handshakes to scenes.
std::string report_json(const RunFigures& figures);

/// Under a temporary name, then renamed. Errors: io.
Status write_text(const std::string& path, const std::string& text);

}  // namespace handloft::client
