#include "client-hmd/main/input.h"

namespace handloft::client {

InputWishes apply_input(const WindowInput& input, ViewState& view) {
  InputWishes wishes{.end = input.close, .screenshot = input.screenshot};
  if (input.toggle_head) {
    view.camera = view.camera == CameraMode::head ? CameraMode::orbit : CameraMode::head;
    wishes.film = view.camera == CameraMode::head;
  }
  if (input.toggle_distances) {
    view.distances = view.distances ? std::nullopt : std::optional(view.distance_scale);
  }
  if (input.toggle_zebra) view.shading = view.shading == Shading::zebra ? Shading::studio : Shading::zebra;
  if (input.fit_view) view.fit_wanted = true;
  return wishes;
}

}  // namespace handloft::client
