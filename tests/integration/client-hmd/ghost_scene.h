#pragma once
// Hands and heads of people who are not there, for pictures. Metres, world frame; deterministic.

#include <cmath>

#include "client-hmd/render/frame.h"

namespace handloft::client::test {

/// A right hand with its palm down, whose fingers' tips lie about `tips` and point along the angle
/// `towards_rad` (pi/2: along +y).
inline HandTips tips_at(const glm::vec3& tips, float towards_rad = 1.5708F, float certainty = 1.0F) {
  const glm::vec3 ahead(std::cos(towards_rad), std::sin(towards_rad), 0.0F);
  const glm::vec3 right(ahead.y, -ahead.x, 0.0F);
  const auto tip = [&](float across, float along, float up) {
    return HandTip{tips + across * right + along * ahead + glm::vec3(0.0F, 0.0F, up), certainty};
  };
  return {tip(-0.062F, -0.058F, -0.004F), tip(-0.030F, -0.006F, 0.0F), tip(-0.008F, 0.006F, 0.002F),
          tip(0.015F, 0.0F, 0.0F), tip(0.038F, -0.020F, -0.004F)};
}

/// Tips of a fist about `place`.
inline HandTips fist_at(const glm::vec3& place) {
  const auto tip = [&](float x, float y, float z) { return HandTip{place + glm::vec3(x, y, z), 1.0F}; };
  return {tip(-0.018F, 0.020F, -0.004F), tip(-0.026F, 0.006F, 0.0F), tip(-0.008F, 0.010F, 0.0F),
          tip(0.010F, 0.008F, 0.0F), tip(0.027F, 0.002F, 0.0F)};
}

/// A head at `place` that looks at `target`.
inline RigidPose looking(const glm::dvec3& place, const glm::dvec3& target) {
  const glm::dvec3 back = glm::normalize(place - target);
  const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0.0, 0.0, 1.0), back));
  return {place, glm::quat_cast(glm::dmat3(right, glm::cross(back, right), back))};
}

/// Anna, opposite, lays points.
inline GhostHint anna() {
  GhostHint ghost;
  ghost.client_id = 2;
  ghost.name = "Anna";
  ghost.doing = "laying points";
  ghost.colour = {0.05F, 0.30F, 0.62F};
  ghost.tips = tips_at({0.05F, 0.03F, 0.075F}, -1.9F);
  ghost.head = looking({0.13, 0.36, 0.30}, {0.02, 0.0, 0.04});
  return ghost;
}

/// Bo, on the left, pushes with a closed hand.
inline GhostHint bo() {
  GhostHint ghost;
  ghost.client_id = 3;
  ghost.name = "Bo";
  ghost.doing = "pushing";
  ghost.entity = "top";
  ghost.colour = {0.60F, 0.20F, 0.02F};
  ghost.tips = fist_at({-0.055F, -0.02F, 0.085F});
  ghost.posture = HandPosture::closed;
  return ghost;
}

}  // namespace handloft::client::test
