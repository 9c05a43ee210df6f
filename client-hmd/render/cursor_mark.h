#pragma once
// The desktop's 3D cursor (V6): a cross in space, a ring as large as the point that it would lay is uncertain
// (A2), a faint grid of the plane that it moves on, and a plumb line to the table, without which nobody sees
// how high it is.

#include <glm/glm.hpp>

namespace handloft::client {

struct CursorMark {
  enum class On {
    plane,  ///< With the grid.
    shape,
    point,  ///< It has caught one: with a smaller, thicker cross.
  };
  glm::vec3 at{0.0F};
  glm::vec3 normal{0.0F, 0.0F, 1.0F};  ///< Of what it lies on; unit.
  glm::vec3 plane_normal{0.0F, 0.0F, 1.0F};
  On on = On::plane;
  float pressure = 0.5F;  ///< 0..1
  bool working = false;   ///< A gesture is in the air: no grid.
};

}  // namespace handloft::client
