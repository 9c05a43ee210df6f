#include "client-hmd/display/stereo_display.h"

#include <algorithm>

namespace handloft::client {

std::vector<View> StereoDisplay::views(int width_px, int height_px) {
  constexpr std::size_t most_layouts = 2;
  const auto known = std::find_if(layouts_.begin(), layouts_.end(), [&](const Layout& layout) {
    return layout.width_px == width_px && layout.height_px == height_px;
  });
  if (known != layouts_.end()) return known->views;
  const HmdCalibration scaled = scaled_to(calibration_, std::max(width_px, 2), std::max(height_px, 2));
  Layout layout{width_px, height_px, {}};
  for (const EyeCalibration& eye : scaled.eyes) layout.views.push_back({eye.area, eye_optics(eye)});
  if (layouts_.size() >= most_layouts) layouts_.erase(layouts_.begin());
  layouts_.push_back(layout);
  return layout.views;
}

}  // namespace handloft::client
