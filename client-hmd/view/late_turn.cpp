#include "client-hmd/view/late_turn.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {

glm::dquat late_turn(const RigidPose& drawn, const std::optional<PoseAnswer>& shown,
                     const LateTurnLimits& limits) {
  const glm::dquat none(1.0, 0.0, 0.0, 0.0);
  if (!shown) return none;
  glm::dquat turn = glm::normalize(shown->pose.orientation * glm::conjugate(drawn.orientation));
  if (turn.w < 0.0) turn = -turn;
  const glm::dvec3 axis(turn.x, turn.y, turn.z);
  const double sine = glm::length(axis);
  const double angle = 2.0 * std::atan2(sine, turn.w);
  const double largest = limits.largest_rad();
  if (!std::isfinite(angle)) return none;
  if (angle <= largest) return turn;
  return glm::angleAxis(largest, axis / sine);
}

int margin_for_turn(const Pinhole& shown, double turn_rad) {
  if (!(turn_rad > 0.0)) return 0;
  // What a turn moves in from outside comes from at most `turn_rad` beyond the edge; towards a corner, about
  // the axis that moves it most, by f (tan(a + turn) - tan(a)) along the ray from the principal point.
  const auto beyond = [turn_rad](double focal_px, double to_edge_px) {
    const double edge = std::atan(std::max(to_edge_px, 0.0) / focal_px);
    const double past = std::min(edge + turn_rad, 1.5);
    return focal_px * (std::tan(past) - std::tan(edge));
  };
  const double right = shown.width_px - 0.5 - shown.cx_px;
  const double left = shown.cx_px + 0.5;
  const double down = shown.height_px - 0.5 - shown.cy_px;
  const double up = shown.cy_px + 0.5;
  const double corner = std::hypot(std::max(left, right), std::max(up, down));
  const double needed = beyond(std::max(shown.fx_px, shown.fy_px), corner);
  const int most = std::min(shown.width_px, shown.height_px) / 2;
  return static_cast<int>(std::clamp(std::ceil(needed) + 1.0, 0.0, static_cast<double>(most)));
}

}  // namespace handloft::client
