#include "client-hmd/view/stereo.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace handloft::client {

EyeOptics eye_optics(const EyeCalibration& eye) {
  return {eye.head_from_eye, undistorted_pinhole(eye), std::make_shared<const LensMesh>(lens_mesh(eye))};
}

std::pair<int, int> overlay_size(std::span<const EyeOptics> eyes) {
  constexpr double clear_share = 0.75;
  double across = 16384.0;
  double down = 16384.0;
  for (const EyeOptics& eye : eyes) {
    const Pinhole& p = eye.shown;
    across = std::min({across, p.cx_px + 0.5, p.width_px - 0.5 - p.cx_px});
    down = std::min({down, p.cy_px + 0.5, p.height_px - 0.5 - p.cy_px});
  }
  const auto side = [](double half) {
    return std::max(1, static_cast<int>(std::lround(2.0 * clear_share * half)));
  };
  return {side(across), side(down)};
}

glm::dvec2 overlay_corner(const EyeOptics& eye, int width_px, int height_px, double depth_m) {
  const double beside_px = -eye.head_from_eye.position.x / depth_m * eye.shown.fx_px;
  return {eye.shown.cx_px + 0.5 + beside_px - 0.5 * width_px, eye.shown.cy_px + 0.5 - 0.5 * height_px};
}

RigidPose compose(const RigidPose& world_from_body, const RigidPose& body_from_part) {
  return {world_from_body.position + world_from_body.orientation * body_from_part.position,
          glm::normalize(world_from_body.orientation * body_from_part.orientation)};
}

glm::dmat3 film_seen_from(const RigidPose& world_from_eye, const RigidPose& world_from_camera,
                          double depth_m) {
  constexpr double nearest_m = 0.01;
  const glm::dmat3 flip(glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, -1));
  const glm::dquat camera_from_world = glm::conjugate(world_from_camera.orientation);
  const glm::dmat3 rotation = flip * glm::mat3_cast(camera_from_world * world_from_eye.orientation) * flip;
  const glm::dvec3 offset =
      flip * (camera_from_world * (world_from_eye.position - world_from_camera.position));
  const double before_plane_m = depth_m - offset.z;
  if (!std::isfinite(before_plane_m) || before_plane_m < nearest_m) return rotation;
  // Of the plane z = depth in the camera's frame: its normal in the eye's frame is the third row of the
  // rotation, its distance from the eye what is left before it.
  const glm::dvec3 normal = glm::transpose(rotation)[2];
  return rotation + glm::outerProduct(offset, normal) / before_plane_m;
}

}  // namespace handloft::client
