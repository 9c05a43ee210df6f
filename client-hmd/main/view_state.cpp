#include "client-hmd/main/view_state.h"

#include <algorithm>
#include <cmath>

#include "client-hmd/main/scene_extent.h"

namespace handloft::client {

namespace {
/// Lenses blur what is beside the middle.
constexpr FitMargins straight_ahead{.side = 0.2, .top_and_bottom = 0.2};
/// Eyes that turn in by more than ten degrees tire.
constexpr double nearest_for_two_eyes_m = 0.35;
}  // namespace

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

void fit_view(ViewState& view, const ModelState& model, int width_px, int height_px, Fitting fitting,
              const std::optional<EyeOptics>& eye) {
  if (!view.fit_wanted || model.snapshots == 0 || model.scene == view.fitted) return;
  const std::vector<glm::dvec3> places = visible_places(*model.scene);
  if (eye) {
    OrbitCamera seen = view.orbit;
    seen.fov_y_rad = 2.0 * std::atan(eye->shown.height_px / (2.0 * eye->shown.fy_px));
    seen.fit(places, eye->shown.width_px, eye->shown.height_px, straight_ahead);
    view.orbit.target = seen.target;
    view.orbit.distance_m = std::max(seen.distance_m, nearest_for_two_eyes_m);
  } else {
    view.orbit.fit(places, width_px, height_px);
  }
  view.fitted = model.scene;
  if (fitting == Fitting::once && !places.empty()) view.fit_wanted = false;
}

}  // namespace handloft::client
