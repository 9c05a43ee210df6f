#pragma once
// What the room's least squares share of Ceres (Agarwal, Mierle and others, ceres-solver.org; Triggs,
// McLauchlan, Hartley, Fitzgibbon, "Bundle adjustment: a modern synthesis", 1999): how a pose is held and
// moved, how a problem is solved, how sure its unknowns are. One thread: the same data give the same bits.

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

namespace handloft::tracking {

/// A pose as Ceres holds it: translation (m) and unit quaternion (x, y, z, w).
inline constexpr int pose_block_size = 7, pose_motion_size = 6;
using PoseBlock = std::array<double, static_cast<std::size_t>(pose_block_size)>;
PoseBlock block_of(const Eigen::Isometry3d& pose);
/// Reads `pose_block_size` numbers; the quaternion need not be exactly of unit length.
Eigen::Isometry3d pose_of(const double* block);

/// Small motions of a pose (translation m, rotation vector rad about the pose's own origin): moved() of
/// reprojection.h.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return pose_block_size; }
  int TangentSize() const override { return pose_motion_size; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/// d (small motion) / d (the pose's seven numbers): turns a derivative by motion into the one Ceres asks for.
Eigen::Matrix<double, pose_motion_size, pose_block_size> motion_by_block(const double* block);

/// What is believed of a pose beforehand: (start minus pose) in standard deviations. A sigma of 0: nothing.
class PosePriorCost final : public ceres::SizedCostFunction<pose_motion_size, pose_block_size> {
 public:
  PosePriorCost(const Eigen::Isometry3d& start, double sigma_m, double sigma_rad);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Eigen::Isometry3d start_;
  Eigen::Matrix<double, pose_motion_size, 1> weights_;
};

enum class LinearSolver : std::uint8_t {
  dense_schur,      ///< Few blocks (cameras, lenses) that many (boards, tags) hang on.
  sparse_cholesky,  ///< Long chains, as a way over time.
};

struct LeastSquaresOptions {
  LinearSolver solver = LinearSolver::dense_schur;
  int max_iterations = 60;
  double converged_share = 1e-12;  ///< Of the cost: a smaller gain is only rounding.
};

struct LeastSquaresOutcome {
  double cost = 0.0;  ///< Sum of the losses, squared sigmas (twice what Ceres calls cost).
  int iterations = 0;
};

/// Minimises over the problem's blocks in place. nullopt when the start itself is impossible (a point behind
/// its camera).
std::optional<LeastSquaresOutcome> minimise(ceres::Problem& problem, const LeastSquaresOptions& options = {});

/// One block of unknowns of which the covariance is asked.
struct AskedBlock {
  const double* values = nullptr;
  int unknowns = 0;  ///< Of small motions: 6 for a pose.
};

/// (J^T J)^-1 of each block, losses applied, by a rank-revealing sparse QR; zeros where something is held
/// fixed. nullopt when the residuals don't determine all of the problem's unknowns.
std::optional<std::vector<Eigen::MatrixXd>> covariances(ceres::Problem& problem,
                                                        const std::vector<AskedBlock>& blocks);

/// Huber's loss of a residual's length in sigmas; nullptr (plain squares) when the limit is not finite.
std::unique_ptr<ceres::LossFunction> huber_loss(double sigmas);

}  // namespace handloft::tracking
