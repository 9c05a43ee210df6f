#include "daemon-tracking/calibration/bundle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "daemon-tracking/calibration/least_squares.h"
#include "daemon-tracking/vision/body_pose.h"

namespace handloft::tracking {
namespace {

constexpr double nearest_depth_m = 1e-3;
constexpr double mad_to_sigma = 1.4826;

Status check(const BundleProblem& problem) {
  for (std::size_t i = 0; i < problem.corners.size(); ++i) {
    const BundleCorner& corner = problem.corners[i];
    const std::string field = fmt::format("corners[{}]", i);
    bool known = corner.lens < problem.lenses.size() && corner.links <= BundleCorner::max_links;
    for (std::size_t link = 0; known && link < corner.links; ++link)
      known = corner.chain[link].pose < problem.poses.size();
    if (!known) return make_error(ErrorCode::invalid_argument, "found an index that names nothing", field);
    if (!corner.point_m.allFinite() || !corner.pixel.allFinite() || !(corner.sigma_px > 0))
      return make_error(ErrorCode::invalid_argument, "found a value that is not finite, or no sigma", field);
  }
  for (std::size_t i = 0; i < problem.poses.size(); ++i)
    if (!problem.poses[i].value.matrix().allFinite())
      return make_error(ErrorCode::invalid_argument, "found a value that is not finite",
                        fmt::format("poses[{}]", i));
  for (std::size_t i = 0; i < problem.lenses.size(); ++i)
    if (!lens_vector(problem.lenses[i].value).allFinite())
      return make_error(ErrorCode::invalid_argument, "found a value that is not finite",
                        fmt::format("lenses[{}]", i));
  return {};
}

Eigen::Vector3d carried(BundleLink::Way way, const Eigen::Isometry3d& pose, const Eigen::Vector3d& point) {
  return way == BundleLink::Way::forward
             ? Eigen::Vector3d(pose * point)
             : Eigen::Vector3d(pose.linear().transpose() * (point - pose.translation()));
}

/// The point in the camera's frame after its whole chain.
Eigen::Vector3d carried(const BundleProblem& problem, const BundleCorner& corner) {
  Eigen::Vector3d point = corner.point_m;
  for (std::size_t link = 0; link < corner.links; ++link)
    point = carried(corner.chain[link].way, problem.poses[corner.chain[link].pose].value, point);
  return point;
}

/// Seen minus expected in sigmas, by its lens and the poses on its way.
class CornerCost final : public ceres::CostFunction {
 public:
  explicit CornerCost(const BundleCorner& corner) : corner_(corner) {
    set_num_residuals(2);
    mutable_parameter_block_sizes()->push_back(lens_unknowns);
    for (std::size_t link = 0; link < corner.links; ++link) {
      // A pose may be passed twice; Ceres wants each block once.
      const auto known = std::find(poses_.begin(), poses_.end(), corner.chain[link].pose);
      slots_[link] = static_cast<std::size_t>(known - poses_.begin());
      if (known != poses_.end()) continue;
      poses_.push_back(corner.chain[link].pose);
      mutable_parameter_block_sizes()->push_back(pose_block_size);
    }
  }
  const std::vector<std::uint32_t>& poses() const { return poses_; }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    std::array<Eigen::Isometry3d, BundleCorner::max_links> poses;
    for (std::size_t slot = 0; slot < poses_.size(); ++slot) poses[slot] = pose_of(parameters[slot + 1]);
    std::array<Eigen::Vector3d, BundleCorner::max_links + 1> points;
    points[0] = corner_.point_m;
    for (std::size_t link = 0; link < corner_.links; ++link)
      points[link + 1] = carried(corner_.chain[link].way, poses[slots_[link]], points[link]);
    const auto seen = project_through(with_lens_vector({}, Eigen::Map<const LensVector>(parameters[0])),
                                      points[corner_.links]);
    if (!seen) return false;
    const double weight = 1.0 / corner_.sigma_px;
    Eigen::Map<Eigen::Vector2d>{residuals} = weight * (corner_.pixel - seen->pixel);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr)
      Eigen::Map<Eigen::Matrix<double, 2, lens_unknowns, Eigen::RowMajor>>{jacobians[0]} =
          -weight * seen->by_lens;
    using ByPose = Eigen::Matrix<double, 2, pose_block_size, Eigen::RowMajor>;
    for (std::size_t slot = 0; slot < poses_.size(); ++slot)
      if (jacobians[slot + 1] != nullptr) Eigen::Map<ByPose>{jacobians[slot + 1]}.setZero();
    // From the camera back along the chain: `ahead` is d residual / d (point after this link).
    Eigen::Matrix<double, 2, 3> ahead = -weight * seen->by_point;
    for (std::size_t link = corner_.links; link-- > 0;) {
      const Eigen::Isometry3d& pose = poses[slots_[link]];
      Eigen::Matrix<double, 2, pose_motion_size> by_motion;
      if (corner_.chain[link].way == BundleLink::Way::forward) {
        // A small motion turns about the pose's own origin: y = t + dt + exp(w) R x.
        by_motion << ahead, -ahead * skew(points[link + 1] - pose.translation());
        ahead = ahead * pose.linear();
      } else {
        ahead = ahead * pose.linear().transpose();
        by_motion << -ahead, ahead * skew(points[link] - pose.translation());
      }
      const std::size_t slot = slots_[link] + 1;
      if (jacobians[slot] != nullptr)
        Eigen::Map<ByPose>{jacobians[slot]} += by_motion * motion_by_block(parameters[slot]);
    }
    return true;
  }

 private:
  BundleCorner corner_;
  std::vector<std::uint32_t> poses_;  ///< Each once.
  std::array<std::size_t, BundleCorner::max_links> slots_{};
};

/// The problem as Ceres sees it; the blocks hold what is being found.
struct Bundle {
  std::vector<LensVector> lenses;
  std::vector<PoseBlock> poses;
  ceres::Problem ceres;
  int unknowns = 0;

  Bundle(const BundleProblem& problem, const BundleOptions& options) {
    for (const BundleLens& lens : problem.lenses) lenses.push_back(lens_vector(lens.value));
    for (const BundlePose& pose : problem.poses) poses.push_back(block_of(pose.value));
    for (std::size_t i = 0; i < lenses.size(); ++i) add_lens(problem.lenses[i], lenses[i].data());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const BundlePose& pose = problem.poses[i];
      double* block = poses[i].data();
      ceres.AddParameterBlock(block, pose_block_size);
      ceres.SetManifold(block, std::make_unique<PoseManifold>().release());
      if (pose.hold == Hold::fixed) {
        ceres.SetParameterBlockConstant(block);
        continue;
      }
      unknowns += pose_motion_size;
      if (pose.prior_sigma_m > 0 || pose.prior_sigma_rad > 0)
        ceres.AddResidualBlock(
            std::make_unique<PosePriorCost>(pose.value, pose.prior_sigma_m, pose.prior_sigma_rad).release(),
            nullptr, block);
    }
    // One loss for all corners; the problem owns it and counts its users.
    ceres::LossFunction* loss =
        problem.corners.empty() ? nullptr : huber_loss(options.huber_sigmas).release();
    for (const BundleCorner& corner : problem.corners) {
      auto cost = std::make_unique<CornerCost>(corner);
      std::vector<double*> blocks{lenses[corner.lens].data()};
      for (const std::uint32_t pose : cost->poses()) blocks.push_back(poses[pose].data());
      ceres.AddResidualBlock(cost.release(), loss, blocks);
    }
  }

 private:
  void add_lens(const BundleLens& lens, double* block) {
    ceres.AddParameterBlock(block, lens_unknowns);
    std::vector<int> fixed;
    for (int i = 0; i < lens_unknowns; ++i)
      if (lens.hold[static_cast<std::size_t>(i)] == Hold::fixed) fixed.push_back(i);
    unknowns += lens_unknowns - static_cast<int>(fixed.size());
    if (fixed.size() == lens_unknowns)
      ceres.SetParameterBlockConstant(block);
    else if (!fixed.empty())
      ceres.SetManifold(block, std::make_unique<ceres::SubsetManifold>(lens_unknowns, fixed).release());
  }
};

/// Fills the standard deviations, or leaves them empty when something is not determined.
void tell_sigmas(const BundleProblem& problem, Bundle& bundle, double unit, BundleOutcome& outcome) {
  std::vector<AskedBlock> asked;
  for (std::size_t i = 0; i < problem.lenses.size(); ++i) {
    const auto& hold = problem.lenses[i].hold;
    const auto free = static_cast<int>(std::count(hold.begin(), hold.end(), Hold::free));
    if (free > 0) asked.push_back({bundle.lenses[i].data(), free});
  }
  for (std::size_t i = 0; i < problem.poses.size(); ++i)
    if (problem.poses[i].hold == Hold::free) asked.push_back({bundle.poses[i].data(), pose_motion_size});
  const auto found = covariances(bundle.ceres, asked);
  if (!found) return;
  auto next = found->begin();
  for (const BundleLens& lens : problem.lenses) {
    LensVector& to = outcome.lens_sigmas.emplace_back(LensVector::Zero());
    Eigen::Index at = 0;
    for (std::size_t j = 0; j < lens_unknowns; ++j) {
      if (lens.hold[j] == Hold::fixed) continue;
      to[static_cast<Eigen::Index>(j)] = unit * std::sqrt((*next)(at, at));
      ++at;
    }
    if (at > 0) ++next;
  }
  for (const BundlePose& pose : problem.poses) {
    auto& to = outcome.pose_sigmas.emplace_back(Eigen::Matrix<double, 6, 1>::Zero());
    if (pose.hold == Hold::free) to = unit * (next++)->diagonal().cwiseSqrt();
  }
}

}  // namespace

LensVector lens_vector(const CameraIntrinsics& lens) {
  LensVector values;
  values << lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.distortion[0], lens.distortion[1],
      lens.distortion[2], lens.distortion[3], lens.distortion[4];
  return values;
}

CameraIntrinsics with_lens_vector(CameraIntrinsics lens, const LensVector& values) {
  lens.fx_px = values[0];
  lens.fy_px = values[1];
  lens.cx_px = values[2];
  lens.cy_px = values[3];
  for (std::size_t i = 0; i < lens.distortion.size(); ++i)
    lens.distortion[i] = values[static_cast<Eigen::Index>(i) + 4];
  return lens;
}

std::optional<LensProjection> project_through(const CameraIntrinsics& lens, const Eigen::Vector3d& point_m) {
  if (!point_m.allFinite() || point_m.z() < nearest_depth_m) return std::nullopt;
  const double k1 = lens.distortion[0], k2 = lens.distortion[1], p1 = lens.distortion[2],
               p2 = lens.distortion[3], k3 = lens.distortion[4];
  const double inverse_z = 1.0 / point_m.z();
  const double x = point_m.x() * inverse_z, y = point_m.y() * inverse_z;
  const double xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy, r4 = r2 * r2, r6 = r4 * r2;
  const double radial = 1.0 + k1 * r2 + k2 * r4 + k3 * r6;
  const double slope = k1 + 2.0 * k2 * r2 + 3.0 * k3 * r4;  // d radial / d r2
  const double u = x * radial + 2.0 * p1 * xy + p2 * (r2 + 2.0 * xx);
  const double v = y * radial + p1 * (r2 + 2.0 * yy) + 2.0 * p2 * xy;
  const double fx = lens.fx_px, fy = lens.fy_px;
  LensProjection out;
  out.pixel = {fx * u + lens.cx_px, fy * v + lens.cy_px};
  Eigen::Matrix2d bend;
  bend(0, 0) = radial + 2.0 * xx * slope + 2.0 * p1 * y + 6.0 * p2 * x;
  bend(0, 1) = bend(1, 0) = 2.0 * xy * slope + 2.0 * p1 * x + 2.0 * p2 * y;
  bend(1, 1) = radial + 2.0 * yy * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  Eigen::Matrix<double, 2, 3> flat;
  flat << inverse_z, 0, -x * inverse_z, 0, inverse_z, -y * inverse_z;
  out.by_point = Eigen::DiagonalMatrix<double, 2>(fx, fy) * bend * flat;
  out.by_lens << u, 0, 1, 0, fx * x * r2, fx * x * r4, fx * 2.0 * xy, fx * (r2 + 2.0 * xx), fx * x * r6,  //
      0, v, 0, 1, fy * y * r2, fy * y * r4, fy * (r2 + 2.0 * yy), fy * 2.0 * xy, fy * y * r6;
  if (!out.pixel.allFinite()) return std::nullopt;
  return out;
}

double robust_sigma(const std::vector<Eigen::Vector2d>& residuals) {
  std::vector<double> sizes;
  sizes.reserve(2 * residuals.size());
  for (const Eigen::Vector2d& residual : residuals) {
    sizes.push_back(std::abs(residual.x()));
    sizes.push_back(std::abs(residual.y()));
  }
  if (sizes.empty()) return 0.0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return mad_to_sigma * *middle;
}

double rms(const std::vector<Eigen::Vector2d>& residuals) {
  if (residuals.empty()) return 0.0;
  double sum = 0.0;
  for (const Eigen::Vector2d& residual : residuals) sum += residual.squaredNorm();
  return std::sqrt(sum / static_cast<double>(residuals.size()));
}

Result<BundleOutcome> adjust(BundleProblem& problem, const BundleOptions& options) {
  if (const Status good = check(problem); !good) return good.error();
  Bundle bundle(problem, options);
  if (2 * problem.corners.size() < static_cast<std::size_t>(bundle.unknowns))
    return make_error(ErrorCode::rank_deficient,
                      fmt::format("found {} corners for {} unknowns, expected more", problem.corners.size(),
                                  bundle.unknowns));
  LeastSquaresOptions solver_options;
  solver_options.max_iterations = options.max_iterations;
  const auto solved = minimise(bundle.ceres, solver_options);
  if (!solved)
    return make_error(ErrorCode::failed_precondition,
                      "some corners are not in front of their cameras at the start");
  for (std::size_t i = 0; i < problem.lenses.size(); ++i)
    problem.lenses[i].value = with_lens_vector(problem.lenses[i].value, bundle.lenses[i]);
  for (std::size_t i = 0; i < problem.poses.size(); ++i)
    if (problem.poses[i].hold == Hold::free) problem.poses[i].value = pose_of(bundle.poses[i].data());

  BundleOutcome outcome;
  outcome.iterations = solved->iterations;
  for (const BundleCorner& corner : problem.corners) {
    const auto seen = project_through(problem.lenses[corner.lens].value, carried(problem, corner));
    outcome.residuals.push_back(seen ? Eigen::Vector2d(corner.pixel - seen->pixel) : Eigen::Vector2d::Zero());
  }
  outcome.rms_px = rms(outcome.residuals);
  // The residuals' own spread is the unit (sigma_0 of surveyors): what the corners were said to be good for
  // is only their proportion.
  const double freedom = 2.0 * static_cast<double>(problem.corners.size()) - bundle.unknowns;
  tell_sigmas(problem, bundle, std::sqrt(solved->cost / std::max(1.0, freedom)), outcome);
  return outcome;
}

}  // namespace handloft::tracking
