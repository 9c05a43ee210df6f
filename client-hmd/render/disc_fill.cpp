#include "client-hmd/render/disc_fill.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {
namespace {

constexpr float any_disc_px = 16.0F;  ///< Four vertices and their setup, in fragments.
constexpr std::size_t sample = 64;

/// Of [middle - half, middle + half], what is within [0, extent].
float within(float middle, float half, float extent) {
  return std::max(0.0F, std::min(extent, middle + half) - std::max(0.0F, middle - half));
}

}  // namespace

float disc_cost_px(const glm::vec3& place, float radius_m, const DiscView& view) {
  const glm::vec4 in_eye = view.eye_from_world * glm::vec4(place, 1.0F);
  const glm::vec4 clip = view.clip_from_eye * in_eye;
  if (!(clip.w > 0.0F) || clip.z < -clip.w) return any_disc_px;
  // As the vertex shader of point_pass.cpp has it.
  const float depth = std::max(-in_eye.z, 1e-3F);
  const float on_screen = radius_m * view.focal_px / depth;
  const float grow = std::max(1.0F, view.smallest_px / std::max(on_screen, 1e-4F));
  const float reach = radius_m * grow + depth / view.focal_px;
  const glm::vec2 half_view = 0.5F * view.viewport_px;
  const glm::vec2 middle = half_view + glm::vec2(clip) / clip.w * half_view;
  const glm::vec2 half =
      reach * glm::vec2(view.clip_from_eye[0][0], view.clip_from_eye[1][1]) / clip.w * half_view;
  return any_disc_px +
         within(middle.x, half.x, view.viewport_px.x) * within(middle.y, half.y, view.viewport_px.y);
}

double cost_px(std::span<const FuzzyPoint> points, std::span<const ShellStyle> styles, const DiscView& view) {
  if (points.empty()) return 0.0;
  const std::size_t step = (points.size() + sample - 1) / sample;
  double sum = 0.0;
  std::size_t looked_at = 0;
  for (std::size_t i = step / 2; i < points.size(); i += step) {
    const Vec3f& place = points[i].position;
    sum += disc_cost_px({place.x, place.y, place.z}, styles[points[i].style].radius_m, view);
    ++looked_at;
  }
  return sum / static_cast<double>(looked_at) * static_cast<double>(points.size());
}

double share_within(double cost_px, const DiscView& view, float coverings) {
  const double most = static_cast<double>(coverings) * static_cast<double>(view.viewport_px.x) *
                      static_cast<double>(view.viewport_px.y);
  return cost_px <= most ? 1.0 : most / cost_px;
}

EveryNth every_nth(std::size_t points, double share) {
  EveryNth every;
  if (points == 0) return every;
  every.n =
      share >= 1.0 ? 1 : std::min(points, static_cast<std::size_t>(std::ceil(1.0 / std::max(share, 1e-9))));
  every.count = (points + every.n - 1) / every.n;
  every.boost = static_cast<float>(points) / static_cast<float>(every.count);
  return every;
}

}  // namespace handloft::client
