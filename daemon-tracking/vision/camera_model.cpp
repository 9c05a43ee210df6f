#include "daemon-tracking/vision/camera_model.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace handloft::tracking {

namespace {

// Points nearer than this to the camera's plane have no usable image.
constexpr double min_depth_m = 1e-3;
// A field of view beyond this normalised radius (84 degrees off axis) is no pinhole camera's.
constexpr double widest_radius = 10.0;
constexpr int inversion_iterations = 60;
constexpr double inversion_tolerance = 1e-9;

struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;  // d distorted / d (x, y)
};

Distorted distort(const std::array<double, 5>& k, double x, double y) {
  const double k1 = k[0], k2 = k[1], p1 = k[2], p2 = k[3], k3 = k[4];
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double radial_slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);  // d radial / d r2
  Distorted out;
  out.point.x() = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  out.point.y() = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  out.jacobian(0, 0) = radial + 2.0 * x * x * radial_slope + 2.0 * p1 * y + 6.0 * p2 * x;
  out.jacobian(0, 1) = 2.0 * x * y * radial_slope + 2.0 * p1 * x + 2.0 * p2 * y;
  out.jacobian(1, 0) = out.jacobian(0, 1);
  out.jacobian(1, 1) = radial + 2.0 * y * y * radial_slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return out;
}

}  // namespace

Result<CameraModel> CameraModel::create(const CameraIntrinsics& intrinsics) {
  const auto bad = [](const char* field, double found, const char* expected) {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected {}", found, expected),
                      field);
  };
  if (intrinsics.width_px < 1 || intrinsics.width_px > max_image_side_px)
    return bad("intrinsics.width_px", intrinsics.width_px, "1..8192");
  if (intrinsics.height_px < 1 || intrinsics.height_px > max_image_side_px)
    return bad("intrinsics.height_px", intrinsics.height_px, "1..8192");
  if (!std::isfinite(intrinsics.fx_px) || intrinsics.fx_px <= 0)
    return bad("intrinsics.fx_px", intrinsics.fx_px, "a positive focal length");
  if (!std::isfinite(intrinsics.fy_px) || intrinsics.fy_px <= 0)
    return bad("intrinsics.fy_px", intrinsics.fy_px, "a positive focal length");
  if (!std::isfinite(intrinsics.cx_px)) return bad("intrinsics.cx_px", intrinsics.cx_px, "a finite number");
  if (!std::isfinite(intrinsics.cy_px)) return bad("intrinsics.cy_px", intrinsics.cy_px, "a finite number");
  for (double k : intrinsics.distortion)
    if (!std::isfinite(k)) return bad("intrinsics.distortion", k, "finite numbers");
  return CameraModel(intrinsics);
}

CameraModel::CameraModel(const CameraIntrinsics& intrinsics) : intrinsics_(intrinsics) {
  // The first radius at which r (1 + k1 r^2 + k2 r^4 + k3 r^6) stops growing, found by walking outwards.
  const auto& k = intrinsics_.distortion;
  constexpr double step = 0.01;
  double radius = 0.0;
  while (radius < widest_radius) {
    const double r2 = (radius + step) * (radius + step);
    if (1.0 + r2 * (3.0 * k[0] + r2 * (5.0 * k[1] + r2 * 7.0 * k[4])) <= 0.0) break;
    radius += step;
  }
  max_radius_squared_ = radius * radius;
}

std::optional<Eigen::Vector2d> CameraModel::project(const Eigen::Vector3d& point_m) const {
  const auto projection = project_with_jacobian(point_m);
  if (!projection) return std::nullopt;
  return projection->pixel;
}

std::optional<Projection> CameraModel::project_with_jacobian(const Eigen::Vector3d& point_m) const {
  if (!point_m.allFinite() || point_m.z() < min_depth_m) return std::nullopt;
  const double inverse_z = 1.0 / point_m.z();
  const double x = point_m.x() * inverse_z, y = point_m.y() * inverse_z;
  if (x * x + y * y > max_radius_squared_) return std::nullopt;
  const Distorted distorted = distort(intrinsics_.distortion, x, y);
  Projection out;
  out.pixel = {intrinsics_.fx_px * distorted.point.x() + intrinsics_.cx_px,
               intrinsics_.fy_px * distorted.point.y() + intrinsics_.cy_px};
  Eigen::Matrix<double, 2, 3> normalised;
  normalised << inverse_z, 0, -x * inverse_z, 0, inverse_z, -y * inverse_z;
  const Eigen::DiagonalMatrix<double, 2> focal(intrinsics_.fx_px, intrinsics_.fy_px);
  out.jacobian = focal * distorted.jacobian * normalised;
  return out;
}

std::optional<Eigen::Vector2d> CameraModel::unproject(const Eigen::Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  const Eigen::Vector2d target((pixel.x() - intrinsics_.cx_px) / intrinsics_.fx_px,
                               (pixel.y() - intrinsics_.cy_px) / intrinsics_.fy_px);
  // Newton with halved steps while a step does not help: converges wherever the model is one-to-one.
  Eigen::Vector2d point = target;
  if (point.squaredNorm() > max_radius_squared_)
    point *= std::sqrt(max_radius_squared_) * 0.9 / std::max(point.norm(), 1e-12);
  Distorted at = distort(intrinsics_.distortion, point.x(), point.y());
  double error = (at.point - target).norm();
  for (int i = 0; i < inversion_iterations && error > inversion_tolerance * 1e-3; ++i) {
    if (std::abs(at.jacobian.determinant()) < 1e-12) return std::nullopt;
    const Eigen::Vector2d step = at.jacobian.inverse() * (target - at.point);
    double share = 1.0;
    bool better = false;
    for (int halving = 0; halving < 8 && !better; ++halving, share *= 0.5) {
      const Eigen::Vector2d trial = point + share * step;
      const Distorted trial_at = distort(intrinsics_.distortion, trial.x(), trial.y());
      const double trial_error = (trial_at.point - target).norm();
      if (trial_error < error) {
        point = trial;
        at = trial_at;
        error = trial_error;
        better = true;
      }
    }
    if (!better) break;
  }
  if (!(error <= inversion_tolerance) || point.squaredNorm() > max_radius_squared_) return std::nullopt;
  return point;
}

std::optional<Eigen::Vector3d> CameraModel::ray(const Eigen::Vector2d& pixel) const {
  const auto point = unproject(pixel);
  if (!point) return std::nullopt;
  return Eigen::Vector3d(point->x(), point->y(), 1.0).normalized();
}

bool CameraModel::contains(const Eigen::Vector2d& pixel, double margin_px) const {
  return pixel.x() >= margin_px && pixel.y() >= margin_px &&
         pixel.x() <= intrinsics_.width_px - 1 - margin_px &&
         pixel.y() <= intrinsics_.height_px - 1 - margin_px;
}

}  // namespace handloft::tracking
