#pragma once
// Decides what one frame shows and from where (V1): with film, everything virtual is placed where it was at
// the film's exposure, so that film and scene agree to the pixel; without, everything is predicted to the
// moment of display; and without a head, the orbit camera looks.

#include "client-hmd/hud/hud.h"
#include "client-hmd/main/ghost_tracker.h"
#include "client-hmd/main/options.h"
#include "client-hmd/main/pin_places.h"
#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/render/colours.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/view/film_feed.h"
#include "client-hmd/view/orbit_camera.h"
#include "client-hmd/view/tracking_feed.h"

namespace handloft::client {

/// What a frame is composed from; feeds may be null.
struct FrameSources {
  std::shared_ptr<const ModelState> model;
  const TrackingFeed* tracking = nullptr;
  FilmFeed* film = nullptr;
  const GhostTracker* ghosts = nullptr;  ///< Null: nobody else is shown.
  const PinPlaces* pins = nullptr;       ///< Null: comments are shown where the server has them.
};

struct FrameRequest {
  CameraMode camera = CameraMode::orbit;
  OrbitCamera orbit;
  int width_px = 0;
  int height_px = 0;
  TimePoint now;
  TimePoint display_time;
  double largest_turn_rad = 0.0;  ///< That the finished picture will be turned by; 0: pictures that are kept.
  std::optional<DistanceScale> distances;  ///< Show those of shapes to references.
  Shading shading = Shading::studio;
  CurvatureView curvature;
  SurfaceOverlays overlays;
  SurfaceEdges edges = SurfaceEdges::soft;
  Surroundings surroundings = Surroundings::workplace;
  HandOcclusion hand_occlusion = HandOcclusion::on;
  ColourScheme colours = ColourScheme::normal;  ///< Of people.
  double latency_ms = 0.0;                      ///< Capture to client, median; 0: unknown.
  HudPlace hud = HudPlace::edges;
  double eye_focal_px = 0.0;                         ///< Of the picture that shows it; 0: as composed.
  glm::vec2 hud_corner_px{0.0F}, hud_size_px{0.0F};  ///< For legends: the part that panels leave.
};

/// Everything but the HUD's text sizes, which need a font: `measure` as in layout_hud().
Frame compose_frame(const FrameRequest& request, const FrameSources& sources,
                    const std::function<float(std::string_view)>& measure);

}  // namespace handloft::client
