#include "client-hmd/view/pinhole.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace handloft::client {

glm::dmat4 Eye::eye_from_world() const {
  const glm::dmat4 rotation = glm::mat4_cast(glm::conjugate(glm::normalize(world_from_eye.orientation)));
  glm::dmat4 translation(1.0);
  translation[3] = glm::dvec4(-world_from_eye.position, 1.0);
  return rotation * translation;
}

Status check_pinhole(const Pinhole& camera) {
  constexpr int max_side_px = 16384;
  const auto side_ok = [](int side) { return side >= 1 && side <= max_side_px; };
  if (!side_ok(camera.width_px) || !side_ok(camera.height_px)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}x{}, expected 1..{} px a side", camera.width_px, camera.height_px, max_side_px),
        "width_px");
  }
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  if (!positive(camera.fx_px) || !positive(camera.fy_px)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found ({}, {}), expected positive focal lengths", camera.fx_px, camera.fy_px), "fx_px");
  }
  const bool finite = std::isfinite(camera.cx_px) && std::isfinite(camera.cy_px) &&
                      std::all_of(camera.distortion.begin(), camera.distortion.end(),
                                  [](double k) { return std::isfinite(k); });
  if (!finite) {
    return make_error(ErrorCode::invalid_argument, "expected a finite principal point and distortion",
                      "cx_px");
  }
  return {};
}

Pinhole covering_pinhole(const Pinhole& camera, int width_px, int height_px) {
  const double scale = std::max(static_cast<double>(width_px) / camera.width_px,
                                static_cast<double>(height_px) / camera.height_px);
  Pinhole out;
  out.width_px = width_px;
  out.height_px = height_px;
  out.fx_px = scale * camera.fx_px;
  out.fy_px = scale * camera.fy_px;
  // Centres of the two pictures coincide; (w - 1) / 2 is the middle of pixels whose centres are integers.
  out.cx_px = (width_px - 1) / 2.0 + scale * (camera.cx_px - (camera.width_px - 1) / 2.0);
  out.cy_px = (height_px - 1) / 2.0 + scale * (camera.cy_px - (camera.height_px - 1) / 2.0);
  return out;
}

Pinhole centred_pinhole(int width_px, int height_px, double fov_y_rad) {
  Pinhole out;
  out.width_px = width_px;
  out.height_px = height_px;
  out.fx_px = out.fy_px = height_px / (2.0 * std::tan(fov_y_rad / 2.0));
  out.cx_px = (width_px - 1) / 2.0;
  out.cy_px = (height_px - 1) / 2.0;
  return out;
}

Pinhole widened(const Pinhole& pinhole, int margin_px) {
  Pinhole out = pinhole;
  out.width_px += 2 * margin_px;
  out.height_px += 2 * margin_px;
  out.cx_px += margin_px;
  out.cy_px += margin_px;
  return out;
}

glm::dvec2 distort(const std::array<double, 5>& coefficients, const glm::dvec2& undistorted) {
  const auto [k1, k2, p1, p2, k3] = coefficients;
  const double x = undistorted.x;
  const double y = undistorted.y;
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

glm::dvec2 project(const Pinhole& camera, const glm::dvec3& in_camera) {
  const glm::dvec2 bent = distort(camera.distortion, glm::dvec2(in_camera) / in_camera.z);
  return {camera.fx_px * bent.x + camera.cx_px, camera.fy_px * bent.y + camera.cy_px};
}

glm::dmat4 projection_matrix(const Pinhole& pinhole, const DepthRange& depth) {
  const double w = pinhole.width_px;
  const double h = pinhole.height_px;
  const double n = depth.near_m;
  const double f = depth.far_m;
  // Window x = pixel + 1/2, window y counts upwards: ndc_x = 2 (fx X/Z + cx + 1/2) / w - 1, ndc_y the other
  // way round.
  glm::dmat4 m(0.0);
  m[0][0] = 2.0 * pinhole.fx_px / w;
  m[1][1] = 2.0 * pinhole.fy_px / h;
  m[2][0] = 1.0 - 2.0 * (pinhole.cx_px + 0.5) / w;
  m[2][1] = 2.0 * (pinhole.cy_px + 0.5) / h - 1.0;
  m[2][2] = -(f + n) / (f - n);
  m[2][3] = -1.0;
  m[3][2] = -2.0 * f * n / (f - n);
  return m;
}

RigidPose eye_from_camera_axes(const RigidPose& world_from_camera) {
  // Half a turn about x: y and z change sign.
  return {world_from_camera.position, world_from_camera.orientation * glm::dquat(0.0, 1.0, 0.0, 0.0)};
}

glm::dmat3 rotation_warp(const Pinhole& pinhole, const glm::dquat& drawn, const glm::dquat& shown) {
  // Pixel -> ray in the eye frame: x = (u - cx) / fx, y = -(v - cy) / fy, z = -1.
  glm::dmat3 pixel_from_ray(0.0);
  pixel_from_ray[0][0] = pinhole.fx_px;
  pixel_from_ray[1][1] = -pinhole.fy_px;
  pixel_from_ray[2] = glm::dvec3(-pinhole.cx_px, -pinhole.cy_px, -1.0);
  const glm::dmat3 drawn_from_shown =
      glm::mat3_cast(glm::conjugate(glm::normalize(drawn)) * glm::normalize(shown));
  return pixel_from_ray * drawn_from_shown * glm::inverse(pixel_from_ray);
}

}  // namespace handloft::client
