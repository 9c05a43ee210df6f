#pragma once
// Where panels are: a bar above, a column on either side that folds away, and the middle left to the work.
// Pure. From 800 x 500 pixels to 4K and text of 80 to 250 %: what does not fit side by side folds away.

#include <glm/glm.hpp>

#include "client-hmd/hud/theme.h"

namespace handloft::client {

/// Pixels, origin top left.
struct PixelRect {
  glm::vec2 corner{0.0F};
  glm::vec2 size{0.0F};
  bool contains(const glm::vec2& at) const {
    return at.x >= corner.x && at.y >= corner.y && at.x < corner.x + size.x && at.y < corner.y + size.y;
  }
  glm::vec2 middle() const { return corner + 0.5F * size; }
};

enum class Side { left, right };

struct PanelLayoutRequest {
  int width_px = 0;
  int height_px = 0;
  float text_px = 15.0F;
  bool left_open = true;
  bool right_open = true;
  Side preferred = Side::left;  ///< Which stays when there is room for one only.
};

struct PanelLayout {
  PixelRect bar;
  bool left_open = false, right_open = false;  ///< As there is room.
  PixelRect left, right;                       ///< Of a folded one: its handle.
  PixelRect middle;                            ///< Between them, below the bar: the work's.
};

PanelLayout panel_layout(const PanelLayoutRequest& request);

/// Height of the panels' text in pixels: by the monitor's density and the picture's height, whichever is
/// larger, times the setting. `content_scale`: 1 for about 96 dots an inch; what is no sensible number is 1.
float panel_text_px(int height_px, float content_scale, int text_percent);

}  // namespace handloft::client
