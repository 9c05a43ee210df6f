#pragma once
// The last turn of a finished picture (V1): from where the head was when everything in it was true to where
// it will be when the display lights up. Rotation only: it keeps film and scene on each other whatever it
// does, since both turn alike. The turn is limited, and pictures are drawn so much larger that the limit's
// turn still shows no edge.

#include <optional>

#include "client-hmd/view/pose_history.h"

namespace handloft::client {

struct LateTurnLimits {
  double fastest_rad_s = 1.5;  ///< 86 degrees a second: faster heads see a blur anyway.
  double longest_s = 0.060;    ///< From exposure to light; as the prediction's horizon (T8).

  double largest_rad() const { return fastest_rad_s * longest_s; }
};

/// In world axes, to be put before the orientation that was drawn with. `shown`: the head when the display
/// lights up; unknown: no turn. Larger turns are cut to the limit about the same axis.
glm::dquat late_turn(const RigidPose& drawn, const std::optional<PoseAnswer>& shown,
                     const LateTurnLimits& limits = {});

/// Pixels that a picture needs on each side of `shown` so that a turn of `turn_rad` about any axis shows no
/// edge; at most half the shorter side.
int margin_for_turn(const Pinhole& shown, double turn_rad);

}  // namespace handloft::client
