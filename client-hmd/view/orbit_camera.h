#pragma once
// The camera of people without a headset: it circles a point above the table (V6).

#include "client-hmd/view/pinhole.h"

namespace handloft::client {

enum class StandardView { perspective, front, top };

struct OrbitCamera {
  glm::dvec3 target{0.035, -0.065, 0.02};  ///< Between the work and the blocks of the palette around it.
  double distance_m = 0.70;
  double azimuth_rad = -1.40;   ///< 0: seen from +x; -pi/2: from -y, the designer's side.
  double elevation_rad = 0.56;  ///< pi/2: from above.
  double fov_y_rad = 0.50;      ///< Long enough not to bend the shape in the eye.

  /// Angles in radians; the elevation stays clear of the poles.
  void orbit(double azimuth_by_rad, double elevation_by_rad);
  /// Shares of the picture's height, to the right and up.
  void pan(double right, double up);
  /// factor > 1 comes nearer; the distance stays within 5 cm to 5 m.
  void zoom(double factor);
  void look(StandardView view);

  Eye eye(int width_px, int height_px) const;
};

}  // namespace handloft::client
