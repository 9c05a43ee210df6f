#include "client-hmd/display/offscreen_display.h"

namespace handloft::client {

Result<std::unique_ptr<Display>> OffscreenDisplay::open(int width_px, int height_px) {
  Result<std::unique_ptr<OffscreenContext>> context = OffscreenContext::create();
  if (!context) return context.error();
  std::unique_ptr<OffscreenDisplay> self(new OffscreenDisplay);
  self->context_ = std::move(*context);
  self->width_px_ = width_px;
  self->height_px_ = height_px;
  return std::unique_ptr<Display>(std::move(self));
}

WindowInput OffscreenDisplay::poll(OrbitCamera&) {
  return {};
}

std::vector<View> OffscreenDisplay::views() const {
  return {View{{0, 0, width_px_, height_px_}}};
}

}  // namespace handloft::client
