#pragma once
// Where a camera is at every moment between keyframes (V8). All of it happens in the orbiting camera's own
// terms (target, direction, distance, angle of view), so that a turn is a turn and not a chord. "Smooth" is a
// cubic Hermite spline with the tangents of Catmull and Rom (1974) for keys at uneven times: through every
// key, without a jump in speed, at rest at both ends unless the path is a loop.

#include <cstddef>
#include <vector>

#include "client-hmd/view/orbit_camera.h"

namespace handloft::client {

enum class Easing { smooth, linear };

struct CameraKey {
  double time_s = 0.0;  ///< From 0, each after the one before.
  OrbitCamera camera;   ///< Azimuths as they are meant: 0 to 2 pi is once round.
};

class CameraPath {
 public:
  enum class Ends { open, loop };

  /// Preconditions: at least one key, times that grow. A loop's last key is where it begins anew: it looks as
  /// the first one does, perhaps some turns on.
  CameraPath(std::vector<CameraKey> keys, Easing easing, Ends ends);

  /// Before the first and after the last key as at it.
  OrbitCamera at(double time_s) const;
  double duration_s() const { return keys_.back().time_s; }

 private:
  std::vector<CameraKey> keys_;
  Easing easing_;
  Ends ends_;
};

/// The orbiting camera at `eye` that looks at `target`, its azimuth within half a turn of `near_azimuth_rad`.
/// Straight above or below, the azimuth is that. Precondition: the two are apart.
OrbitCamera looking_from(const glm::dvec3& eye, const glm::dvec3& target, double fov_y_rad,
                         double near_azimuth_rad);

}  // namespace handloft::client
