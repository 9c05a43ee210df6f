#include "client-hmd/desktop/camera_control.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace handloft::client {
namespace {

constexpr double zoom_per_step = 1.12;
constexpr double most_steps = 10.0;

}  // namespace

void orbit_about(OrbitCamera& camera, const glm::dvec3& pivot, const glm::dvec2& moved_px,
                 const PictureSize& size) {
  const double height = std::max(size.height_px, 1);
  const glm::dquat before = camera.eye(size.width_px, size.height_px).world_from_eye.orientation;
  camera.orbit(-moved_px.x / height * glm::pi<double>(), moved_px.y / height * glm::pi<double>());
  const glm::dquat after = camera.eye(size.width_px, size.height_px).world_from_eye.orientation;
  camera.target = pivot + after * (glm::conjugate(before) * (camera.target - pivot));
}

void pan_with(OrbitCamera& camera, const glm::dvec3& held, const glm::dvec2& moved_px,
              const PictureSize& size) {
  const Eye eye = camera.eye(size.width_px, size.height_px);
  const glm::dvec3 in_eye = eye.eye_from_world() * glm::dvec4(held, 1.0);
  const double metres_per_pixel = std::max(-in_eye.z, eye.depth.near_m) / eye.pinhole.fy_px;
  const glm::dvec3 by(-moved_px.x * metres_per_pixel, moved_px.y * metres_per_pixel, 0.0);
  camera.target += eye.world_from_eye.orientation * by;
}

void zoom_to(OrbitCamera& camera, const glm::dvec3& held, double steps, const PictureSize& size) {
  const glm::dquat facing = camera.eye(size.width_px, size.height_px).world_from_eye.orientation;
  const glm::dvec3 back = facing * glm::dvec3(0.0, 0.0, 1.0);
  const double before_m = camera.distance_m;
  const glm::dvec3 from = camera.target + before_m * back;
  camera.zoom(std::pow(zoom_per_step, std::clamp(steps, -most_steps, most_steps)));
  const double shrunk = camera.distance_m / before_m;  // Less where the zoom met its limits.
  camera.target = held + (from - held) * shrunk - camera.distance_m * back;
}

}  // namespace handloft::client
