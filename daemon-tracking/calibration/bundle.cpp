#include "daemon-tracking/calibration/bundle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daemon-tracking/calibration/least_squares.h"
#include "daemon-tracking/vision/body_pose.h"
#include "daemon-tracking/vision/reprojection.h"

namespace handloft::tracking {
namespace {

constexpr double nearest_depth_m = 1e-3;
constexpr double mad_to_sigma = 1.4826;
constexpr Eigen::Index pose_unknowns = 6;

/// Where each free block's unknowns begin; -1 for fixed ones.
struct Layout {
  std::vector<std::array<Eigen::Index, lens_unknowns>> lens;
  std::vector<Eigen::Index> pose;
  Eigen::Index unknowns = 0;

  explicit Layout(const BundleProblem& problem) {
    for (const BundleLens& one : problem.lenses) {
      auto& at = lens.emplace_back();
      for (std::size_t i = 0; i < lens_unknowns; ++i) at[i] = one.hold[i] == Hold::free ? unknowns++ : -1;
    }
    for (const BundlePose& one : problem.poses) {
      pose.push_back(one.hold == Hold::free ? unknowns : -1);
      if (one.hold == Hold::free) unknowns += pose_unknowns;
    }
  }
};

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

/// The point in the camera's frame after its whole chain.
Eigen::Vector3d carried(const BundleProblem& problem, const BundleCorner& corner) {
  Eigen::Vector3d point = corner.point_m;
  for (std::size_t link = 0; link < corner.links; ++link) {
    const Eigen::Isometry3d& pose = problem.poses[corner.chain[link].pose].value;
    point = corner.chain[link].way == BundleLink::Way::forward
                ? Eigen::Vector3d(pose * point)
                : Eigen::Vector3d(pose.linear().transpose() * (point - pose.translation()));
  }
  return point;
}

using Block = NormalEquations::Block;

/// Derivatives of the residual by all free unknowns on the corner's way.
void derivatives(const BundleProblem& problem, const Layout& layout, const BundleCorner& corner,
                 const LensProjection& seen, std::vector<Block>& blocks) {
  blocks.clear();
  const auto& lens_at = layout.lens[corner.lens];
  for (std::size_t i = 0; i < lens_unknowns; ++i) {
    if (lens_at[i] < 0) continue;
    blocks.push_back({lens_at[i], -seen.by_lens.col(static_cast<Eigen::Index>(i))});
  }
  // From the camera back along the chain: `ahead` is d pixel / d (point after this link).
  std::array<Eigen::Vector3d, BundleCorner::max_links + 1> points;
  points[0] = corner.point_m;
  for (std::size_t link = 0; link < corner.links; ++link) {
    const Eigen::Isometry3d& pose = problem.poses[corner.chain[link].pose].value;
    points[link + 1] = corner.chain[link].way == BundleLink::Way::forward
                           ? Eigen::Vector3d(pose * points[link])
                           : Eigen::Vector3d(pose.linear().transpose() * (points[link] - pose.translation()));
  }
  Eigen::Matrix<double, 2, 3> ahead = seen.by_point;
  for (std::size_t link = corner.links; link-- > 0;) {
    const BundleLink& step = corner.chain[link];
    const Eigen::Matrix3d axes = problem.poses[step.pose].value.linear();
    const Eigen::Index at = layout.pose[step.pose];
    Eigen::Matrix<double, 2, 6> by_pose;
    if (step.way == BundleLink::Way::forward) {
      // moved(pose, d) turns about the pose's own origin: y = t + dt + exp(w) R x.
      by_pose.leftCols<3>() = ahead;
      by_pose.rightCols<3>() = -ahead * skew(points[link + 1] - problem.poses[step.pose].value.translation());
      ahead = ahead * axes;
    } else {
      const Eigen::Matrix<double, 2, 3> turned = ahead * axes.transpose();
      by_pose.leftCols<3>() = -turned;
      by_pose.rightCols<3>() = turned * skew(points[link] - problem.poses[step.pose].value.translation());
      ahead = turned;
    }
    if (at >= 0) blocks.push_back({at, -by_pose});
  }
}

/// Adds what was believed of a pose beforehand; gives its cost.
double pull(const BundlePose& pose, const Eigen::Isometry3d& start, Eigen::Index at,
            NormalEquations* equations) {
  Eigen::Matrix<double, 6, 1> step;
  step << start.translation() - pose.value.translation(),
      vector_from_rotation(Eigen::Quaterniond(start.linear() * pose.value.linear().transpose()));
  double cost = 0.0;
  for (Eigen::Index i = 0; i < pose_unknowns; ++i) {
    const double sigma = i < 3 ? pose.prior_sigma_m : pose.prior_sigma_rad;
    if (!(sigma > 0)) continue;
    const double information = 1.0 / (sigma * sigma);
    cost += step[i] * step[i] * information;
    if (equations != nullptr) equations->add_prior(at + i, step[i], information);
  }
  return cost;
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
  const Layout layout(problem);
  if (2 * problem.corners.size() < static_cast<std::size_t>(layout.unknowns))
    return make_error(ErrorCode::rank_deficient,
                      fmt::format("found {} corners for {} unknowns, expected more", problem.corners.size(),
                                  layout.unknowns));
  BundleProblem before;
  std::vector<Eigen::Isometry3d> starts;
  for (const BundlePose& pose : problem.poses) starts.push_back(pose.value);
  std::vector<Block> blocks;
  const auto evaluate = [&](NormalEquations* equations) -> std::optional<double> {
    double cost = 0.0;
    for (const BundleCorner& corner : problem.corners) {
      const auto seen = project_through(problem.lenses[corner.lens].value, carried(problem, corner));
      if (!seen) return std::nullopt;
      const double information = 1.0 / (corner.sigma_px * corner.sigma_px);
      const Eigen::Vector2d residual = corner.pixel - seen->pixel;
      const HuberLoss loss = huber(residual.squaredNorm() * information, options.huber_sigmas);
      cost += loss.loss;
      if (equations == nullptr) continue;
      derivatives(problem, layout, corner, *seen, blocks);
      equations->add(blocks, residual, loss.weight * information);
    }
    for (std::size_t i = 0; i < problem.poses.size(); ++i)
      if (layout.pose[i] >= 0) cost += pull(problem.poses[i], starts[i], layout.pose[i], equations);
    return cost;
  };
  LeastSquaresProblem solver;
  solver.unknowns = layout.unknowns;
  solver.evaluate = evaluate;
  solver.apply = [&](const Eigen::VectorXd& step) {
    before.lenses = problem.lenses;
    before.poses = problem.poses;
    for (std::size_t i = 0; i < problem.lenses.size(); ++i) {
      LensVector values = lens_vector(problem.lenses[i].value);
      for (std::size_t j = 0; j < lens_unknowns; ++j)
        if (layout.lens[i][j] >= 0) values[static_cast<Eigen::Index>(j)] += step[layout.lens[i][j]];
      problem.lenses[i].value = with_lens_vector(problem.lenses[i].value, values);
    }
    for (std::size_t i = 0; i < problem.poses.size(); ++i)
      if (layout.pose[i] >= 0)
        problem.poses[i].value = moved(problem.poses[i].value, step.segment<pose_unknowns>(layout.pose[i]));
  };
  solver.undo = [&] {
    problem.lenses = before.lenses;
    problem.poses = before.poses;
  };
  LeastSquaresOptions solver_options;
  solver_options.max_iterations = options.max_iterations;
  const auto solved = minimise(solver, solver_options);
  if (!solved)
    return make_error(ErrorCode::failed_precondition,
                      "some corners are not in front of their cameras at the start");

  BundleOutcome outcome;
  outcome.iterations = solved->iterations;
  for (const BundleCorner& corner : problem.corners) {
    const auto seen = project_through(problem.lenses[corner.lens].value, carried(problem, corner));
    outcome.residuals.push_back(seen ? Eigen::Vector2d(corner.pixel - seen->pixel) : Eigen::Vector2d::Zero());
  }
  outcome.rms_px = rms(outcome.residuals);
  NormalEquations equations(layout.unknowns);
  const auto cost = evaluate(&equations);
  const auto covariance = equations.covariance();
  if (cost && covariance) {
    const double freedom =
        2.0 * static_cast<double>(problem.corners.size()) - static_cast<double>(layout.unknowns);
    const double unit = std::sqrt(*cost / std::max(1.0, freedom));
    const auto sigma = [&](Eigen::Index at) {
      return at < 0 ? 0.0 : unit * std::sqrt((*covariance)(at, at));
    };
    for (const auto& lens : layout.lens) {
      LensVector& to = outcome.lens_sigmas.emplace_back();
      for (std::size_t j = 0; j < lens_unknowns; ++j) to[static_cast<Eigen::Index>(j)] = sigma(lens[j]);
    }
    for (const Eigen::Index pose : layout.pose) {
      auto& to = outcome.pose_sigmas.emplace_back();
      for (Eigen::Index j = 0; j < pose_unknowns; ++j) to[j] = pose < 0 ? 0.0 : sigma(pose + j);
    }
  }
  return outcome;
}

}  // namespace handloft::tracking
