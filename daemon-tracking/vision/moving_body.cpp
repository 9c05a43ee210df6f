#include "daemon-tracking/vision/moving_body.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <optional>

#include "daemon-tracking/vision/reprojection.h"

namespace handloft::tracking {

namespace {

constexpr int corners_per_tag = 4;
constexpr int corner_residuals = 2;
constexpr int prior_residuals = 12;
/// What a corner behind the camera costs, in sigmas: no solver stays there.
constexpr double out_of_sight = 1e6;

/// Residuals over (translation, rotation, change of velocity, change of angular velocity) from the prior's
/// mean.
class MovingBodyCost {
 public:
  // The names are those of ceres::TinySolver.
  using Scalar = double;
  // NOLINTBEGIN(readability-identifier-naming)
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 12 };

  MovingBodyCost(const BodyView& view, std::span<const double> delays_s, const MovingBody& prior,
                 const Matrix12d& whitening, const BodyPoseOptions& options)
      : view_(view), delays_s_(delays_s), prior_(prior), whitening_(whitening), options_(options) {}

  int NumResiduals() const {
    return corner_residuals * static_cast<int>(view_.corners.size()) + prior_residuals;
  }
  // NOLINTEND(readability-identifier-naming)

  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    const Eigen::Map<const Vector12d> step(parameters);
    const int count = NumResiduals();
    Eigen::Map<Eigen::VectorXd> out(residuals, count);
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 12>> slope(jacobian, jacobian ? count : 0, 12);
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < view_.corners.size(); ++i) {
      const Vector6d motion = step.head<6>() + delays_s_[i] * (prior_.rate + step.tail<6>());
      const auto image = image_of(view_, view_.corners[i], moved(prior_.base_from_body, motion));
      if (!image) {
        out.setConstant(out_of_sight);
        slope.setZero();
        return false;
      }
      const RobustError error = robust_error(image->pixel - view_.corners[i].pixel, options_);
      out.segment<2>(row) = error.residual;
      if (jacobian != nullptr) {
        Eigen::Matrix<double, 2, 6> along = error.slope * image->jacobian;
        along.rightCols<3>() *= left_jacobian(motion.tail<3>());
        slope.block<2, 6>(row, 0) = along;
        slope.block<2, 6>(row, 6) = delays_s_[i] * along;
      }
      row += corner_residuals;
    }
    out.tail<prior_residuals>() = whitening_ * step;
    if (jacobian != nullptr) slope.bottomRows<prior_residuals>() = whitening_;
    return true;
  }

  /// Root mean square distance of the corners from where they were seen; nullopt when one is out of sight.
  std::optional<double> rms_px(const Vector12d& step) const {
    double squares = 0.0;
    for (std::size_t i = 0; i < view_.corners.size(); ++i) {
      const Vector6d motion = step.head<6>() + delays_s_[i] * (prior_.rate + step.tail<6>());
      const auto image = image_of(view_, view_.corners[i], moved(prior_.base_from_body, motion));
      if (!image) return std::nullopt;
      squares += (image->pixel - view_.corners[i].pixel).squaredNorm();
    }
    return std::sqrt(squares / static_cast<double>(view_.corners.size()));
  }

 private:
  const BodyView& view_;
  std::span<const double> delays_s_;
  const MovingBody& prior_;
  const Matrix12d& whitening_;
  const BodyPoseOptions& options_;
};

Status check(const BodyView& view, std::span<const double> delays_s, const MovingBody& prior) {
  if (view.camera == nullptr || !view.carrier_from_camera.matrix().allFinite())
    return make_error(ErrorCode::invalid_argument,
                      "found a view without a camera or with a pose that is not finite", "view");
  if (view.corners.empty())
    return make_error(ErrorCode::failed_precondition, "found no tag, expected at least one", "view");
  if (delays_s.size() != view.corners.size())
    return make_error(ErrorCode::invalid_argument, "found another number of delays than of corners",
                      "delays_s");
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    if (!view.corners[i].point_m.allFinite() || !view.corners[i].pixel.allFinite())
      return make_error(ErrorCode::invalid_argument, "found a corner that is not finite", "view.corners");
    if (!std::isfinite(delays_s[i]))
      return make_error(ErrorCode::invalid_argument, "found a delay that is not finite", "delays_s");
  }
  if (!prior.base_from_body.matrix().allFinite() || !prior.rate.allFinite() || !prior.covariance.allFinite())
    return make_error(ErrorCode::invalid_argument, "found a prior that is not finite", "prior");
  return {};
}

Error no_pose() {
  return make_error(ErrorCode::failed_precondition, "no motion explains the corners that were seen");
}

}  // namespace

Result<MovingBodyFit> correct_moving_body(const BodyView& view, std::span<const double> delays_s,
                                          const MovingBody& prior, const BodyPoseOptions& options) {
  if (Status good = check(view, delays_s, prior); !good) return good.error();
  const Eigen::LLT<Matrix12d> factor(prior.covariance);
  if (factor.info() != Eigen::Success) return no_pose();
  const Matrix12d whitening = factor.matrixL().solve(Matrix12d::Identity());
  const MovingBodyCost cost(view, delays_s, prior, whitening, options);
  Vector12d step = Vector12d::Zero();
  if (!cost.rms_px(step)) return no_pose();
  ceres::TinySolver<MovingBodyCost> solver;
  solver.options.max_num_iterations = options.max_iterations;
  solver.options.function_tolerance = options.converged_cost;
  solver.Solve(cost, &step);

  MovingBodyFit out;
  const auto rms_px = cost.rms_px(step);
  if (!step.allFinite() || !rms_px || *rms_px > options.max_rms_px) return no_pose();
  Eigen::VectorXd residuals(cost.NumResiduals());
  Eigen::Matrix<double, Eigen::Dynamic, 12> jacobian(cost.NumResiduals(), 12);
  if (!cost(step.data(), residuals.data(), jacobian.data())) return no_pose();
  const Eigen::LDLT<Matrix12d> information(jacobian.transpose() * jacobian);
  if (information.info() != Eigen::Success || !information.isPositive()) return no_pose();
  out.body.covariance = information.solve(Matrix12d::Identity());
  out.body.covariance = 0.5 * (out.body.covariance + out.body.covariance.transpose()).eval();
  out.body.base_from_body = moved(prior.base_from_body, step.head<6>());
  out.body.rate = prior.rate + step.tail<6>();
  if (!out.body.covariance.allFinite() || !out.body.base_from_body.matrix().allFinite()) return no_pose();
  out.reprojection_rms_px = *rms_px;
  out.tags = static_cast<int>(view.corners.size()) / corners_per_tag;
  const Eigen::LDLT<Matrix6d> pose_factor(prior.covariance.topLeftCorner<6, 6>());
  out.surprise = step.head<6>().dot(pose_factor.solve(step.head<6>()));
  return out;
}

}  // namespace handloft::tracking
