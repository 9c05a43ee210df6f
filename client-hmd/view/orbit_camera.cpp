#include "client-hmd/view/orbit_camera.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

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

Eye OrbitCamera::eye(int width_px, int height_px) const {
  const Axes axes = axes_of(*this);
  Eye out;
  out.world_from_eye.position = target + distance_m * axes.back;
  out.world_from_eye.orientation = glm::normalize(glm::quat_cast(glm::dmat3(axes.right, axes.up, axes.back)));
  out.pinhole = centred_pinhole(width_px, height_px, fov_y_rad);
  return out;
}

}  // namespace handloft::client
