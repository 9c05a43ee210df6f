#include "server-model/geometry/symmetry.h"

namespace handloft::geometry {

Result<Plane> make_plane(const Vec3& origin, const Vec3& normal) {
  if (!origin.allFinite()) {
    return make_error(ErrorCode::invalid_argument, "found a coordinate that is not finite", "origin");
  }
  const Vec3 unit = normal.stableNormalized();
  if (!normal.allFinite() || !(normal.stableNorm() > 0) || !unit.allFinite()) {
    return make_error(ErrorCode::invalid_argument,
                      "found no direction, expected a finite vector that is not 0", "normal");
  }
  return Plane{origin, unit};
}

Vec3 reflect_point(const Vec3& point, const Plane& plane) {
  return point - 2 * (point - plane.origin).dot(plane.normal) * plane.normal;
}

Vec3 reflect_direction(const Vec3& direction, const Plane& plane) {
  return direction - 2 * direction.dot(plane.normal) * plane.normal;
}

Frame reflect_frame(const Frame& frame, const Plane& plane) {
  Frame mirrored;
  mirrored.origin = reflect_point(frame.origin, plane);
  mirrored.rotation.col(0) = reflect_direction(frame.x_axis(), plane);
  mirrored.rotation.col(1) = -reflect_direction(frame.y_axis(), plane);
  mirrored.rotation.col(2) = reflect_direction(frame.normal(), plane);
  return mirrored;
}

}  // namespace handloft::geometry
