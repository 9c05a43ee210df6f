#include "client-hmd/main/view_state.h"

#include "client-hmd/main/scene_extent.h"

namespace handloft::client {

ViewState::ViewState(const HmdOptions& options)
    : camera(options.camera),
      distance_scale{static_cast<float>(options.distance_range_mm / 1e3)},
      shading(options.shading),
      curvature(options.curvature),
      overlays(options.overlays),
      edges(options.edges),
      surroundings(options.surroundings),
      fit_wanted(options.view == ViewChoice::fit) {
  if (options.distances) distances = distance_scale;
  orbit.azimuth_rad = glm::radians(options.azimuth_deg);
  orbit.elevation_rad = glm::radians(options.camera_elevation_deg);
}

void fit_view(ViewState& view, const ModelState& model, int width_px, int height_px, Fitting fitting) {
  if (!view.fit_wanted || model.snapshots == 0 || model.scene == view.fitted) return;
  const std::vector<glm::dvec3> places = visible_places(*model.scene);
  view.orbit.fit(places, width_px, height_px);
  view.fitted = model.scene;
  if (fitting == Fitting::once && !places.empty()) view.fit_wanted = false;
}

}  // namespace handloft::client
