#pragma once
// What each eye sees of a frame that was composed for the middle between them (V4): the same things at the
// same time, from its own place and through its own optics. The head camera's film is the same for both, and
// reprojected for each as if all of it were `film_depth_m` before the camera (film_seen_from()). The overlay
// is where both eyes see it well.

#include "client-hmd/render/frame.h"
#include "client-hmd/view/stereo.h"

namespace handloft::client {

struct EyeFrameOptions {
  /// Where the film is taken to be; infinite: it is only turned. Half a metre before the eyes lies the work.
  double film_depth_m = 0.5;
  double largest_turn_rad = 0.0;  ///< That present() will make; 0: none.
  double overlay_depth_m = 0.7;   ///< Before the eyes: a little beyond the work, where they are anyway.
  int overlay_width_px = 0;       ///< What the overlay was laid out for.
  int overlay_height_px = 0;
};

Frame frame_of_eye(const Frame& middle, const EyeOptics& optics, const EyeFrameOptions& options);

}  // namespace handloft::client
