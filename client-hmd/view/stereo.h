#pragma once
// Two eyes instead of one: where each is, and how the head camera's film looks from there.

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <utility>

#include "client-hmd/view/hmd_calibration.h"
#include "client-hmd/view/lens_mesh.h"

namespace handloft::client {

/// Through what one eye sees the screen.
struct EyeOptics {
  RigidPose head_from_eye;
  Pinhole shown;                         ///< Undistorted.
  std::shared_ptr<const LensMesh> lens;  ///< Never null.
};

/// For a calibration that is scaled to its canvas.
EyeOptics eye_optics(const EyeCalibration& eye);

/// Width and height of an overlay that all these eyes see about straight ahead, in pixels of the first's
/// picture: part of the common field of view, since lenses blur what is beside it.
std::pair<int, int> overlay_size(std::span<const EyeOptics> eyes);
/// Where in the eye's picture the overlay's top left corner is, so that both eyes see it `depth_m` away.
glm::dvec2 overlay_corner(const EyeOptics& eye, int width_px, int height_px, double depth_m);

/// Pose of what is fixed to something that moves.
RigidPose compose(const RigidPose& world_from_body, const RigidPose& body_from_part);

/// Direction in the film camera's frame from direction in the eye's (both y down, z forward), were everything
/// filmed on the plane `depth_m` before the camera: there film and virtual things agree to the pixel; at
/// depth z they are apart by (distance of eye and camera) * |1/z - 1/depth_m| radians. Infinite depth: the
/// rotation alone. Poses with OpenGL axes. An eye on or beyond that plane gets the rotation alone.
glm::dmat3 film_seen_from(const RigidPose& world_from_eye, const RigidPose& world_from_camera,
                          double depth_m);

}  // namespace handloft::client
