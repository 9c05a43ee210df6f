#include "daemon-tracking/vision/triangulation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace handloft::tracking {

namespace {

Error disagree(const char* message) {
  return make_error(ErrorCode::failed_precondition, message, "views");
}

}  // namespace

Result<TriangulatedPoint> triangulate(std::span<const PointView> views, const TriangulationOptions& options) {
  if (views.size() < 2) return disagree("found fewer than two views");
  std::vector<Eigen::Vector3d> rays;
  Eigen::Matrix3d lhs = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (const PointView& view : views) {
    if (view.camera == nullptr || !view.pixel.allFinite() || !view.covariance.allFinite() ||
        !view.world_from_camera.matrix().allFinite() || !(view.covariance.determinant() > 0.0))
      return make_error(ErrorCode::invalid_argument, "found a view that is not finite or has no covariance",
                        "views");
    const auto ray = view.camera->ray(view.pixel);
    if (!ray) return disagree("found a pixel that no direction belongs to");
    rays.push_back(view.world_from_camera.linear() * *ray);
    // Least squares of the distances to the rays: the linear start.
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - rays.back() * rays.back().transpose();
    const double weight = 1.0 / view.covariance.trace();
    lhs += weight * across;
    rhs += weight * across * view.world_from_camera.translation();
  }
  TriangulatedPoint out;
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t j = i + 1; j < rays.size(); ++j)
      out.widest_angle_rad = std::max(
          out.widest_angle_rad, std::atan2(rays[i].cross(rays[j]).norm(), std::abs(rays[i].dot(rays[j]))));
  if (out.widest_angle_rad < options.min_ray_angle_rad) return disagree("the rays are too parallel to meet");
  out.position_m = lhs.ldlt().solve(rhs);

  for (int iteration = 0; iteration <= options.iterations; ++iteration) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    out.worst_sigmas = 0.0;
    for (const PointView& view : views) {
      const Eigen::Matrix3d camera_from_world = view.world_from_camera.linear().transpose();
      const auto projection = view.camera->project_with_jacobian(
          camera_from_world * (out.position_m - view.world_from_camera.translation()));
      if (!projection) return disagree("the rays meet behind a camera");
      const Eigen::Matrix2d weight = view.covariance.inverse();
      const Eigen::Vector2d residual = view.pixel - projection->pixel;
      const Eigen::Matrix<double, 2, 3> jacobian = projection->jacobian * camera_from_world;
      information += jacobian.transpose() * weight * jacobian;
      gradient += jacobian.transpose() * weight * residual;
      out.worst_sigmas = std::max(out.worst_sigmas, std::sqrt(residual.dot(weight * residual)));
    }
    const Eigen::LDLT<Eigen::Matrix3d> factor(information);
    if (factor.info() != Eigen::Success || !factor.isPositive())
      return disagree("the views do not fix a point");
    out.covariance = factor.solve(Eigen::Matrix3d::Identity());
    if (iteration < options.iterations) out.position_m += factor.solve(gradient);
  }
  if (!out.position_m.allFinite() || !out.covariance.allFinite())
    return disagree("the views do not fix a point");
  if (out.worst_sigmas > options.max_sigmas) return disagree("the views disagree: not one point");
  out.covariance = 0.5 * (out.covariance + out.covariance.transpose()).eval();
  return out;
}

}  // namespace handloft::tracking
