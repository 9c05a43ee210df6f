#include "client-hmd/view/orbit_camera.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>

namespace handloft::client {
namespace {

struct Axes {
  glm::dvec3 right, up, back;
};

Axes axes_of(const OrbitCamera& camera) {
  const double ce = std::cos(camera.elevation_rad);
  const glm::dvec3 back(ce * std::cos(camera.azimuth_rad), ce * std::sin(camera.azimuth_rad),
                        std::sin(camera.elevation_rad));
  const glm::dvec3 right(-std::sin(camera.azimuth_rad), std::cos(camera.azimuth_rad), 0.0);
  return {right, glm::cross(back, right), back};
}

}  // namespace

void OrbitCamera::orbit(double azimuth_by_rad, double elevation_by_rad) {
  constexpr double pole_rad = glm::half_pi<double>() - 1e-3;
  azimuth_rad = std::remainder(azimuth_rad + azimuth_by_rad, glm::two_pi<double>());
  elevation_rad = std::clamp(elevation_rad + elevation_by_rad, -pole_rad, pole_rad);
}

void OrbitCamera::pan(double right, double up) {
  const Axes axes = axes_of(*this);
  const double height_m = 2.0 * distance_m * std::tan(fov_y_rad / 2.0);
  target -= height_m * (right * axes.right + up * axes.up);
}

void OrbitCamera::zoom(double factor) {
  constexpr double nearest_m = 0.05;
  constexpr double farthest_m = 5.0;
  if (std::isfinite(factor) && factor > 0.0)
    distance_m = std::clamp(distance_m / factor, nearest_m, farthest_m);
}

void OrbitCamera::look(StandardView view) {
  const OrbitCamera standard;
  switch (view) {
    case StandardView::perspective:
      azimuth_rad = standard.azimuth_rad;
      elevation_rad = standard.elevation_rad;
      break;
    case StandardView::front:
      azimuth_rad = -glm::half_pi<double>();
      elevation_rad = 0.08;  // A touch from above, so that the table stays a surface.
      break;
    case StandardView::top:
      azimuth_rad = -glm::half_pi<double>();
      elevation_rad = glm::half_pi<double>() - 1e-3;
      break;
  }
}

// A place with camera coordinates (x, y) and z backwards is within the picture's sides when
// |x - cx| <= tx (cz - z), the camera being at (cx, cy, cz): the outermost x + tx z and -x + tx z give cx,
// and the least cz; likewise y.
void OrbitCamera::fit(std::span<const glm::dvec3> places, int width_px, int height_px,
                      const FitMargins& margins) {
  if (places.empty() || width_px <= 0 || height_px <= 0) return;
  const Axes axes = axes_of(*this);
  const double half_height = std::tan(fov_y_rad / 2.0);
  const double ty = half_height * (1.0 - 2.0 * margins.top_and_bottom);
  const double tx = half_height * width_px / height_px * (1.0 - 2.0 * margins.side);
  constexpr double lowest = std::numeric_limits<double>::lowest();
  double right = lowest, left = lowest, top = lowest, bottom = lowest, front = lowest;
  double deepest = std::numeric_limits<double>::max();
  for (const glm::dvec3& place : places) {
    const double x = glm::dot(place, axes.right);
    const double y = glm::dot(place, axes.up);
    const double z = glm::dot(place, axes.back);
    if (!std::isfinite(x + y + z)) return;
    right = std::max(right, x + tx * z);
    left = std::max(left, -x + tx * z);
    top = std::max(top, y + ty * z);
    bottom = std::max(bottom, -y + ty * z);
    front = std::max(front, z);
    deepest = std::min(deepest, z);
  }
  constexpr double nearest_m = 0.05;  // Before the foremost place, as zoom() comes no nearer.
  const double z = std::max({(right + left) / (2.0 * tx), (top + bottom) / (2.0 * ty), front + nearest_m});
  // Orbiting is then about the middle of what is seen.
  distance_m = z - (front + deepest) / 2.0;
  target = (right - left) / 2.0 * axes.right + (top - bottom) / 2.0 * axes.up + (z - distance_m) * axes.back;
}

Eye OrbitCamera::eye(int width_px, int height_px) const {
  const Axes axes = axes_of(*this);
  Eye out;
  out.world_from_eye.position = target + distance_m * axes.back;
  out.world_from_eye.orientation = glm::normalize(glm::quat_cast(glm::dmat3(axes.right, axes.up, axes.back)));
  out.pinhole = centred_pinhole(width_px, height_px, fov_y_rad);
  return out;
}

}  // namespace handloft::client
