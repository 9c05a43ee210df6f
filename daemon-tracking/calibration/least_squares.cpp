#include "daemon-tracking/calibration/least_squares.h"

#include <cmath>
#include <memory>

#include "daemon-tracking/calibration/spline.h"
#include "daemon-tracking/vision/body_pose.h"

namespace handloft::tracking {
namespace {

template <int rows, int columns>
using RowMajor = Eigen::Map<Eigen::Matrix<double, rows, columns, Eigen::RowMajor>>;

/// 2 d q / d w for q' = exp(w) q: its transpose inverts it on unit quaternions.
Eigen::Matrix<double, 4, 3> turn(const double* block) {
  const Eigen::Map<const Eigen::Quaterniond> q(block + 3);
  Eigen::Matrix<double, 4, 3> out;
  out << q.w() * Eigen::Matrix3d::Identity() - skew(q.vec()), -q.vec().transpose();
  return out;
}

}  // namespace

PoseBlock block_of(const Eigen::Isometry3d& pose) {
  PoseBlock block{};
  Eigen::Map<Eigen::Vector3d>(block.data()) = pose.translation();
  Eigen::Map<Eigen::Quaterniond>(block.data() + 3) = Eigen::Quaterniond(pose.linear()).normalized();
  return block;
}

Eigen::Isometry3d pose_of(const double* block) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Map<const Eigen::Vector3d>(block);
  pose.linear() = Eigen::Map<const Eigen::Quaterniond>(block + 3).normalized().toRotationMatrix();
  return pose;
}

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Map<const Eigen::Vector3d> shift(delta), rotation(delta + 3);
  Eigen::Map<Eigen::Vector3d>{x_plus_delta} = Eigen::Map<const Eigen::Vector3d>(x) + shift;
  Eigen::Map<Eigen::Quaterniond>(x_plus_delta + 3) =
      (rotation_from_vector(rotation) * Eigen::Map<const Eigen::Quaterniond>(x + 3)).normalized();
  return true;
}

bool PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  RowMajor<pose_block_size, pose_motion_size> out(jacobian);
  out.setZero();
  out.topLeftCorner<3, 3>().setIdentity();
  out.bottomRightCorner<4, 3>() = 0.5 * turn(x);
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Eigen::Vector3d>{y_minus_x} =
      Eigen::Map<const Eigen::Vector3d>(y) - Eigen::Map<const Eigen::Vector3d>(x);
  Eigen::Map<Eigen::Vector3d>(y_minus_x + 3) = vector_from_rotation(
      Eigen::Map<const Eigen::Quaterniond>(y + 3) * Eigen::Map<const Eigen::Quaterniond>(x + 3).conjugate());
  return true;
}

bool PoseManifold::MinusJacobian(const double* x, double* jacobian) const {
  RowMajor<pose_motion_size, pose_block_size>{jacobian} = motion_by_block(x);
  return true;
}

Eigen::Matrix<double, pose_motion_size, pose_block_size> motion_by_block(const double* block) {
  Eigen::Matrix<double, pose_motion_size, pose_block_size> out =
      Eigen::Matrix<double, pose_motion_size, pose_block_size>::Zero();
  out.topLeftCorner<3, 3>().setIdentity();
  out.bottomRightCorner<3, 4>() = 2.0 * turn(block).transpose();
  return out;
}

PosePriorCost::PosePriorCost(const Eigen::Isometry3d& start, double sigma_m, double sigma_rad)
    : start_(start) {
  weights_.head<3>().setConstant(sigma_m > 0 ? 1.0 / sigma_m : 0.0);
  weights_.tail<3>().setConstant(sigma_rad > 0 ? 1.0 / sigma_rad : 0.0);
}

bool PosePriorCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Isometry3d pose = pose_of(parameters[0]);
  Eigen::Matrix<double, pose_motion_size, 1> step;
  step << start_.translation() - pose.translation(),
      vector_from_rotation(Eigen::Quaterniond(start_.linear() * pose.linear().transpose()));
  Eigen::Map<Eigen::Matrix<double, pose_motion_size, 1>>{residuals} = weights_.cwiseProduct(step);
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  // log(E exp(-w)) = log(E) - Jr^-1 w, and the right Jacobian of r is the left one of -r.
  Eigen::Matrix<double, pose_motion_size, pose_motion_size> by_motion =
      -Eigen::Matrix<double, pose_motion_size, pose_motion_size>::Identity();
  by_motion.bottomRightCorner<3, 3>() = -left_jacobian_of(-step.tail<3>()).inverse();
  RowMajor<pose_motion_size, pose_block_size>{jacobians[0]} =
      weights_.asDiagonal() * by_motion * motion_by_block(parameters[0]);
  return true;
}

std::optional<LeastSquaresOutcome> minimise(ceres::Problem& problem, const LeastSquaresOptions& options) {
  ceres::Solver::Options how;
  how.minimizer_type = ceres::TRUST_REGION;
  how.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  how.linear_solver_type =
      options.solver == LinearSolver::dense_schur ? ceres::DENSE_SCHUR : ceres::SPARSE_NORMAL_CHOLESKY;
  how.max_num_iterations = options.max_iterations;
  how.function_tolerance = options.converged_share;
  // The cost alone tells when it is over: pixels, metres and radians have no gradient or step in common.
  how.gradient_tolerance = 1e-14;
  how.parameter_tolerance = 1e-14;
  how.num_threads = 1;
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost)) return std::nullopt;
  return LeastSquaresOutcome{2.0 * summary.final_cost, static_cast<int>(summary.iterations.size())};
}

std::optional<std::vector<Eigen::MatrixXd>> covariances(ceres::Problem& problem,
                                                        const std::vector<AskedBlock>& blocks) {
  std::vector<Eigen::MatrixXd> out;
  if (blocks.empty()) return out;
  ceres::Covariance::Options how;
  how.algorithm_type = ceres::SPARSE_QR;
  how.num_threads = 1;
  ceres::Covariance covariance(how);
  std::vector<std::pair<const double*, const double*>> pairs;
  pairs.reserve(blocks.size());
  for (const AskedBlock& block : blocks) pairs.emplace_back(block.values, block.values);
  if (!covariance.Compute(pairs, &problem)) return std::nullopt;
  for (const AskedBlock& block : blocks) {
    std::vector<double> numbers(static_cast<std::size_t>(block.unknowns * block.unknowns), 0.0);
    if (!covariance.GetCovarianceBlockInTangentSpace(block.values, block.values, numbers.data()))
      return std::nullopt;
    // Symmetric: the order of rows and columns is all the same.
    out.emplace_back(Eigen::Map<const Eigen::MatrixXd>(numbers.data(), block.unknowns, block.unknowns));
    if (!out.back().allFinite()) return std::nullopt;
  }
  return out;
}

std::unique_ptr<ceres::LossFunction> huber_loss(double sigmas) {
  if (!std::isfinite(sigmas)) return nullptr;
  return std::make_unique<ceres::HuberLoss>(sigmas);
}

}  // namespace handloft::tracking
