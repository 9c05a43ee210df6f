#include "client-hmd/display/offscreen_display.h"

namespace handloft::client {

Result<std::unique_ptr<Display>> OffscreenDisplay::open(int width_px, int height_px) {
  std::unique_ptr<OffscreenDisplay> self(new OffscreenDisplay);
  if (const Status made = self->renew(); !made) return made.error();
  self->width_px_ = width_px;
  self->height_px_ = height_px;
  return std::unique_ptr<Display>(std::move(self));
}

Status OffscreenDisplay::renew() {
  context_.reset();
  Result<std::unique_ptr<OffscreenContext>> context = OffscreenContext::create();
  if (!context) return context.error();
  context_ = std::move(*context);
  return {};
}

WindowInput OffscreenDisplay::poll(OrbitCamera&) {
  return {};
}

std::vector<View> OffscreenDisplay::views(int width_px, int height_px) {
  return {View{{0, 0, width_px, height_px}, std::nullopt}};
}

}  // namespace handloft::client
