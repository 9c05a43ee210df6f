#pragma once
// The camera of people at a desk, moved about what they look at: it turns about the place under the pointer,
// slides so that this place stays under it, and comes nearer to it (V6).

#include <glm/glm.hpp>

#include "client-hmd/view/orbit_camera.h"

namespace handloft::client {

struct PictureSize {
  int width_px = 1;
  int height_px = 1;
};

/// Half a turn a picture's height; `pivot` (world, metres) stays where it is seen, to the pixel.
void orbit_about(OrbitCamera& camera, const glm::dvec3& pivot, const glm::dvec2& moved_px,
                 const PictureSize& size);

/// `held` goes along with the pointer.
void pan_with(OrbitCamera& camera, const glm::dvec3& held, const glm::dvec2& moved_px,
              const PictureSize& size);

/// `steps` of the wheel nearer; `held` stays where it is seen. Six steps double the size.
void zoom_to(OrbitCamera& camera, const glm::dvec3& held, double steps, const PictureSize& size);

}  // namespace handloft::client
