#pragma once
// What people chose to see: set by the options at first, changed by input, read for every frame.

#include "client-hmd/main/options.h"
#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/view/orbit_camera.h"
#include "client-hmd/view/stereo.h"

namespace handloft::client {

struct ViewState {
  explicit ViewState(const HmdOptions& options);

  OrbitCamera orbit;
  CameraMode camera = CameraMode::orbit;
  std::optional<DistanceScale> distances;  ///< Shown when present.
  DistanceScale distance_scale;            ///< For when they are shown.
  Shading shading = Shading::studio;
  CurvatureView curvature;
  SurfaceOverlays overlays;
  SurfaceEdges edges = SurfaceEdges::soft;
  Surroundings surroundings = Surroundings::workplace;
  bool fit_wanted = false;
  std::shared_ptr<const Scene> fitted;  ///< What the view was fitted to last.
};

/// Whether the view is fitted whenever the scene changes, or once and then left to people.
enum class Fitting { follow, once };

/// When a fit is wanted and the scene is another one: as near as all of it allows in a plain picture of that
/// size; through `eye`, a headset's, as near as all of it is about straight ahead, but no nearer than two
/// eyes like.
void fit_view(ViewState& view, const ModelState& model, int width_px, int height_px, Fitting fitting,
              const std::optional<EyeOptics>& eye = std::nullopt);

}  // namespace handloft::client
