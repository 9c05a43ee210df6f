#pragma once
// What people chose to see, as the panels show it and may ask to change it: the frame loop's state as a
// value.

#include <string>

#include "client-hmd/render/look.h"

namespace handloft::client {

struct ViewChoices {
  Shading shading = Shading::studio;
  CurvatureKind curvature = CurvatureKind::mean;
  SurfaceOverlays overlays;
  bool distances = false;
  bool follow_head = false;
  std::string display = "One picture in a window";  ///< Words for mono, stereo, ...
  bool operator==(const ViewChoices&) const = default;
};

}  // namespace handloft::client
