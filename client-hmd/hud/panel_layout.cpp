#include "client-hmd/hud/panel_layout.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {
namespace {

constexpr float least_middle_share = 0.36F;   ///< Of the width, with both columns open.
constexpr float widest_column_share = 0.50F;  ///< Of the width, for a single one.
constexpr float lines_of_text = 72.0F;        ///< The picture's height at 100 % and usual density.
constexpr float handle_width = 1.6F, handle_height = 6.0F;
constexpr float bar_height = 2.7F;

}  // namespace

PanelLayout panel_layout(const PanelLayoutRequest& request) {
  const float em = request.text_px;
  const auto width = static_cast<float>(std::max(request.width_px, 1));
  const auto height = static_cast<float>(std::max(request.height_px, 1));
  const float margin = panel_sizes.margin * em;
  const float column = std::min(panel_sizes.column * em, widest_column_share * width);

  PanelLayout layout;
  layout.left_open = request.left_open;
  layout.right_open = request.right_open;
  if (layout.left_open && layout.right_open &&
      width - 2.0F * (column + margin) < least_middle_share * width) {
    (request.preferred == Side::left ? layout.right_open : layout.left_open) = false;
  }
  layout.bar = {{margin, margin}, {std::max(width - 2.0F * margin, 1.0F), bar_height * em}};
  const float top = 2.0F * margin + layout.bar.size.y;
  const float below = std::max(height - top - margin, 1.0F);
  const glm::vec2 handle{handle_width * em, std::min(handle_height * em, below)};
  layout.left = {{margin, top}, {column, below}};
  if (!layout.left_open) layout.left = {{0.0F, top}, handle};
  layout.right = {{width - margin - column, top}, {column, below}};
  if (!layout.right_open) layout.right = {{width - handle.x, top}, handle};
  const float from = layout.left.corner.x + layout.left.size.x + margin;
  const float to = layout.right.corner.x - margin;
  layout.middle = {{from, top}, {std::max(to - from, 1.0F), below}};
  return layout;
}

float panel_text_px(int height_px, float content_scale, int text_percent) {
  const float scale = std::isfinite(content_scale) ? std::clamp(content_scale, 0.5F, 4.0F) : 1.0F;
  const float usual = std::max(panel_sizes.text_px * scale, static_cast<float>(height_px) / lines_of_text);
  const int percent = std::clamp(text_percent, 80, 250);
  return std::round(usual * static_cast<float>(percent) / 100.0F);
}

}  // namespace handloft::client
