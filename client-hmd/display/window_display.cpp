#include "client-hmd/display/window_display.h"

namespace handloft::client {

Result<std::unique_ptr<Display>> WindowDisplay::open(int width_px, int height_px) {
  Result<std::unique_ptr<Window>> window = Window::open(width_px, height_px, "Handloft");
  if (!window) return window.error();
  std::unique_ptr<WindowDisplay> self(new WindowDisplay);
  self->window_ = std::move(*window);
  return std::unique_ptr<Display>(std::move(self));
}

std::vector<View> WindowDisplay::views() const {
  return {View{{0, 0, width_px(), height_px()}}};
}

}  // namespace handloft::client
