#include "daemon-tracking/source/simulated/lens.h"

#include <Eigen/LU>

namespace handloft::tracking {
namespace {

using Eigen::Vector2d;

/// Points nearer than this to the camera's plane have no image.
constexpr double nearest_m = 0.01;
constexpr int newton_steps = 12;
constexpr double newton_tolerance = 1e-12;

}  // namespace

Vector2d Lens::distort(const Vector2d& ray) const {
  const auto [k1, k2, p1, p2, k3] = intrinsics_.distortion;
  const double x = ray.x(), y = ray.y();
  const double r2 = ray.squaredNorm();
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

std::optional<Vector2d> Lens::project(const Eigen::Vector3d& point_m) const {
  if (!(point_m.z() > nearest_m)) return std::nullopt;
  const Vector2d distorted = distort(point_m.head<2>() / point_m.z());
  return Vector2d(intrinsics_.fx_px * distorted.x() + intrinsics_.cx_px,
                  intrinsics_.fy_px * distorted.y() + intrinsics_.cy_px);
}

Vector2d Lens::ray(const Vector2d& pixel) const {
  const Vector2d target((pixel.x() - intrinsics_.cx_px) / intrinsics_.fx_px,
                        (pixel.y() - intrinsics_.cy_px) / intrinsics_.fy_px);
  Vector2d ray = target;
  constexpr double h = 1e-6;
  for (int step = 0; step < newton_steps; ++step) {
    const Vector2d error = distort(ray) - target;
    if (error.squaredNorm() < newton_tolerance * newton_tolerance) break;
    Eigen::Matrix2d jacobian;
    jacobian.col(0) = (distort(ray + Vector2d(h, 0)) - distort(ray - Vector2d(h, 0))) / (2 * h);
    jacobian.col(1) = (distort(ray + Vector2d(0, h)) - distort(ray - Vector2d(0, h))) / (2 * h);
    ray -= jacobian.inverse() * error;
  }
  return ray;
}

}  // namespace handloft::tracking
