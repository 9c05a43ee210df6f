#include "daemon-tracking/vision/triangulation.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace handloft::tracking {

namespace {

// A change of the cost (squared sigmas) that is only rounding.
constexpr double converged_cost = 1e-12;
// Far above any residual of a point in front of all cameras, and its square still a number.
constexpr double out_of_sight = 1e30;

Error disagree(const char* message) {
  return make_error(ErrorCode::failed_precondition, message, "views");
}

/// Reprojection errors of a point in each view's own sigmas, as ceres::TinySolver takes them.
struct PointCost {
  using Scalar = double;
  // NOLINTBEGIN(readability-identifier-naming)
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 3 };

  std::span<const PointView> views;

  int NumResiduals() const { return 2 * static_cast<int>(views.size()); }
  // NOLINTEND(readability-identifier-naming)

  bool operator()(const double* position, double* residuals, double* jacobian) const {
    Eigen::Map<Eigen::VectorXd> out(residuals, NumResiduals());
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 3>> slope(jacobian, jacobian ? NumResiduals() : 0, 3);
    Eigen::Index row = 0;
    for (const PointView& view : views) {
      const Eigen::Matrix3d camera_from_world = view.world_from_camera.linear().transpose();
      const auto projection = view.camera->project_with_jacobian(
          camera_from_world *
          (Eigen::Map<const Eigen::Vector3d>(position) - view.world_from_camera.translation()));
      if (!projection) {
        out.setConstant(out_of_sight);
        slope.setZero();
        return false;
      }
      const Eigen::LLT<Eigen::Matrix2d> sigma(view.covariance);
      out.segment<2>(row) = sigma.matrixL().solve(projection->pixel - view.pixel);
      if (jacobian != nullptr)
        slope.middleRows<2>(row) = sigma.matrixL().solve(projection->jacobian * camera_from_world);
      row += 2;
    }
    return true;
  }
};

}  // namespace

Result<TriangulatedPoint> triangulate(std::span<const PointView> views, const TriangulationOptions& options) {
  if (views.size() < 2) return disagree("found fewer than two views");
  std::vector<Eigen::Vector3d> rays;
  Eigen::Matrix3d lhs = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (const PointView& view : views) {
    if (view.camera == nullptr || !view.pixel.allFinite() || !view.covariance.allFinite() ||
        !view.world_from_camera.matrix().allFinite() || !(view.covariance(0, 0) > 0.0) ||
        !(view.covariance.determinant() > 0.0))
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

  const PointCost cost{views};
  ceres::TinySolver<PointCost> solver;
  solver.options.max_num_iterations = options.max_iterations;
  solver.options.function_tolerance = converged_cost;
  solver.Solve(cost, &out.position_m);
  Eigen::VectorXd residuals(cost.NumResiduals());
  Eigen::Matrix<double, Eigen::Dynamic, 3> jacobian(cost.NumResiduals(), 3);
  if (!cost(out.position_m.data(), residuals.data(), jacobian.data()))
    return disagree("the rays meet behind a camera");
  for (Eigen::Index row = 0; row < residuals.size(); row += 2)
    out.worst_sigmas = std::max(out.worst_sigmas, residuals.segment<2>(row).norm());
  const Eigen::LDLT<Eigen::Matrix3d> information(jacobian.transpose() * jacobian);
  if (information.info() != Eigen::Success || !information.isPositive())
    return disagree("the views do not fix a point");
  out.covariance = information.solve(Eigen::Matrix3d::Identity());
  if (!out.position_m.allFinite() || !out.covariance.allFinite())
    return disagree("the views do not fix a point");
  if (out.worst_sigmas > options.max_sigmas) return disagree("the views disagree: not one point");
  out.covariance = 0.5 * (out.covariance + out.covariance.transpose()).eval();
  return out;
}

}  // namespace handloft::tracking
