#include "client-hmd/render/cursor_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace handloft::client {
namespace {

/// A2: R = L (1 - rho), at least 2 % of L.
constexpr float uncertain_m = 0.0127F;
constexpr float least_ring_m = 0.02F * uncertain_m;
constexpr int ring_corners = 48;
constexpr float arm_m = 0.009F;
constexpr float caught_arm_m = 0.005F;
constexpr float normal_m = 0.014F;
constexpr float grid_step_m = 0.01F;
constexpr int grid_steps = 5;  ///< To each side.
constexpr float plumb_dash_m = 0.006F;
constexpr float table_m = 0.0F;
constexpr float foot_m = 0.004F;
constexpr float farthest_m = 10.0F;

constexpr glm::vec3 ink{0.02F, 0.03F, 0.05F};
constexpr glm::vec3 faint{0.33F, 0.36F, 0.40F};
constexpr RibbonStyle cross{ink, 2.2F, 0.0F, 0.45F};
constexpr RibbonStyle caught{ink, 3.6F, 0.0F, 0.45F};
constexpr RibbonStyle ring{ink, 1.8F, 0.0F, 0.4F};
constexpr RibbonStyle grid{faint, 0.8F, 0.0F, 0.0F};
constexpr RibbonStyle plumb{faint, 1.4F, plumb_dash_m, 0.0F};

struct Axes {
  glm::vec3 along, across;
};

/// Along the world's own axes where that is possible: a grid that lies like the table.
Axes axes_of(const glm::vec3& normal) {
  const glm::vec3 least =
      std::abs(normal.x) < 0.9F ? glm::vec3(1.0F, 0.0F, 0.0F) : glm::vec3(0.0F, 1.0F, 0.0F);
  const glm::vec3 along = glm::normalize(least - glm::dot(least, normal) * normal);
  return {along, glm::cross(normal, along)};
}

bool is_place(const glm::vec3& at) {
  return std::abs(at.x) <= farthest_m && std::abs(at.y) <= farthest_m && std::abs(at.z) <= farthest_m;
}

bool is_unit(const glm::vec3& direction) {
  return std::abs(glm::dot(direction, direction) - 1.0F) < 1e-2F;
}

void add_ring(const glm::vec3& centre, const Axes& axes, float radius_m, Ribbons& lines) {
  std::array<Vec3f, ring_corners> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const float angle = glm::two_pi<float>() * static_cast<float>(i) / static_cast<float>(ring_corners);
    const glm::vec3 at = centre + radius_m * (std::cos(angle) * axes.along + std::sin(angle) * axes.across);
    corners[i] = {at.x, at.y, at.z};
  }
  lines.add(corners, true, ring);
}

void add_grid(const CursorMark& cursor, Ribbons& lines) {
  const Axes axes = axes_of(cursor.plane_normal);
  const float reach = grid_step_m * static_cast<float>(grid_steps);
  // On whole centimetres, so that it stands still while the cursor goes over it.
  const auto whole = [](float value) { return grid_step_m * std::round(value / grid_step_m); };
  const float u = glm::dot(cursor.at, axes.along);
  const float v = glm::dot(cursor.at, axes.across);
  const glm::vec3 middle = cursor.at + (whole(u) - u) * axes.along + (whole(v) - v) * axes.across;
  for (int i = -grid_steps; i <= grid_steps; ++i) {
    const float by = grid_step_m * static_cast<float>(i);
    const glm::vec3 on_along = middle + by * axes.along;
    const glm::vec3 on_across = middle + by * axes.across;
    lines.add_segment(on_along - reach * axes.across, on_along + reach * axes.across, grid);
    lines.add_segment(on_across - reach * axes.along, on_across + reach * axes.along, grid);
  }
}

}  // namespace

void add_cursor(const CursorMark& cursor, const glm::vec3& towards, Ribbons& lines) {
  if (!is_place(cursor.at) || !is_unit(cursor.normal) || !is_unit(cursor.plane_normal)) return;
  if (cursor.on == CursorMark::On::plane && !cursor.working) add_grid(cursor, lines);
  const glm::vec3 foot(cursor.at.x, cursor.at.y, table_m);
  if (cursor.at.z > table_m + foot_m) {
    lines.add_segment(cursor.at, foot, plumb);
    lines.add_segment(foot - glm::vec3(foot_m, 0.0F, 0.0F), foot + glm::vec3(foot_m, 0.0F, 0.0F), plumb);
    lines.add_segment(foot - glm::vec3(0.0F, foot_m, 0.0F), foot + glm::vec3(0.0F, foot_m, 0.0F), plumb);
  }
  const Axes axes = axes_of(cursor.normal);
  const bool point = cursor.on == CursorMark::On::point;
  const float arm = point ? caught_arm_m : arm_m;
  const RibbonStyle& style = point ? caught : cross;
  lines.add_segment(cursor.at - arm * axes.along, cursor.at + arm * axes.along, style);
  lines.add_segment(cursor.at - arm * axes.across, cursor.at + arm * axes.across, style);
  lines.add_segment(cursor.at, cursor.at + normal_m * cursor.normal, style);
  const glm::vec3 way = towards - cursor.at;
  const float away_m = glm::length(way);
  if (!(away_m > 1e-4F)) return;
  const float certain = std::clamp(cursor.pressure, 0.0F, 1.0F);
  add_ring(cursor.at, axes_of(way / away_m), std::max(least_ring_m, uncertain_m * (1.0F - certain)), lines);
}

}  // namespace handloft::client
