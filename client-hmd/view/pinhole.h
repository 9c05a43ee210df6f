#pragma once
// The camera that a picture is drawn through. Virtual content registers with the filmed picture when both go
// through the same pinhole (V1): the film is undistorted into it in the shader, the scene is projected with
// its matrix. Camera frame: x right, y down, z forward; pixels with the centre of the top left pixel at (0,
// 0) (OpenCV's). Eye frame: x right, y up, z backwards (OpenGL's).

#include <array>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "common/base/result.h"

namespace handloft::client {

/// Intrinsics with Brown-Conrady distortion k1, k2, p1, p2, k3. The pixel grid is that of `width_px` x
/// `height_px`.
struct Pinhole {
  int width_px = 1280;
  int height_px = 720;
  double fx_px = 1000.0;
  double fy_px = 1000.0;
  double cx_px = 639.5;
  double cy_px = 359.5;
  std::array<double, 5> distortion{};
};

struct RigidPose {
  glm::dvec3 position{0.0};
  glm::dquat orientation{1.0, 0.0, 0.0, 0.0};
};

/// Near and far planes: a hand's breadth before the eyes to the end of a large room.
struct DepthRange {
  double near_m = 0.03;
  double far_m = 20.0;
};

/// Where and through what the scene is seen: all that a renderer needs.
struct Eye {
  RigidPose world_from_eye;  ///< OpenGL axes.
  Pinhole pinhole;           ///< Of the output picture; its distortion is not applied to virtual content.
  DepthRange depth;

  glm::dmat4 eye_from_world() const;
};

/// Errors: invalid_argument naming the field for a size outside 1..16384 px, a focal length that is not
/// positive and finite, or a principal point or distortion that is not finite.
Status check_pinhole(const Pinhole& camera);

/// A distortion-free pinhole for a picture of `width_px` x `height_px` that the camera's picture fills
/// completely (the longer side is cropped): square scale, principal point carried along.
Pinhole covering_pinhole(const Pinhole& camera, int width_px, int height_px);

/// A centred pinhole with the vertical field of view `fov_y_rad`.
Pinhole centred_pinhole(int width_px, int height_px, double fov_y_rad);

/// The same view with `margin_px` more on each side; with less when negative.
Pinhole widened(const Pinhole& pinhole, int margin_px);

/// Normalised image coordinates (X/Z, Y/Z) as the lens bends them.
glm::dvec2 distort(const std::array<double, 5>& coefficients, const glm::dvec2& undistorted);

/// Pixel of a point in the camera frame with z > 0, through the lens.
glm::dvec2 project(const Pinhole& camera, const glm::dvec3& in_camera);

/// Clip space from eye space such that a point lands on the pixel that `project` of an undistorted pinhole
/// names.
glm::dmat4 projection_matrix(const Pinhole& pinhole, const DepthRange& depth);

/// Turns a camera's pose (y down, z forward) into the eye's (y up, z backwards).
RigidPose eye_from_camera_axes(const RigidPose& world_from_camera);

/// The homography that turns a picture drawn at `drawn` into what `shown` sees, were everything far away: the
/// late rotation to the display time (V1). Maps homogeneous display pixels to pixels of the drawn picture.
glm::dmat3 rotation_warp(const Pinhole& pinhole, const glm::dquat& drawn, const glm::dquat& shown);

}  // namespace handloft::client
