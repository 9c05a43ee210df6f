#pragma once
// The camera of people without a headset: it circles a point above the table (V6).

#include <span>

#include "client-hmd/view/pinhole.h"

namespace handloft::client {

/// Left free when a picture is fitted, as shares of its size: room for the HUD's lines above and below.
struct FitMargins {
  double side = 0.06;
  double top_and_bottom = 0.14;
};

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
  /// Comes as near as it can while all `places` (world, metres) are within the margins of a picture of that
  /// size; the direction stays. No places, or one that is no number: nothing changes.
  void fit(std::span<const glm::dvec3> places, int width_px, int height_px, const FitMargins& margins = {});

  Eye eye(int width_px, int height_px) const;
};

}  // namespace handloft::client
