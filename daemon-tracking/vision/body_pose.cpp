#include "daemon-tracking/vision/body_pose.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "daemon-tracking/vision/reprojection.h"

namespace handloft::tracking {

namespace {

constexpr int corners_per_tag = 4;
constexpr std::size_t max_candidates = 24;  // Two per tag; more tags than 12 add nothing to a start.
constexpr std::size_t refined_candidates = 4;
// Poses that differ by less than this are one local minimum.
constexpr double distinct_angle_rad = 0.05;
constexpr double distinct_distance_m = 0.02;

Status check(std::span<const BodyView> views, const std::optional<PosePrior>& prior) {
  std::size_t corners = 0;
  for (const BodyView& view : views) {
    if (view.camera == nullptr || !view.carrier_from_camera.matrix().allFinite())
      return make_error(ErrorCode::invalid_argument,
                        "found a view without a camera or with a pose that is not finite", "views");
    if (view.corners.size() % corners_per_tag != 0)
      return make_error(ErrorCode::invalid_argument, "found a part of a tag, expected four corners for each",
                        "views");
    for (const CornerMeasurement& corner : view.corners)
      if (!corner.point_m.allFinite() || !corner.pixel.allFinite())
        return make_error(ErrorCode::invalid_argument, "found a corner that is not finite", "views.corners");
    corners += view.corners.size();
  }
  if (corners < corners_per_tag)
    return make_error(ErrorCode::failed_precondition, "found no tag, expected at least one", "views");
  if (prior && (!prior->base_from_body.matrix().allFinite() || !prior->covariance.allFinite()))
    return make_error(ErrorCode::invalid_argument, "found a prior that is not finite", "prior");
  return {};
}

/// Both poses of one square tag, as base_from_body, or none when its corners make no square's image.
void add_square_poses(const BodyView& view, std::size_t first, std::vector<Eigen::Isometry3d>& candidates) {
  const Eigen::Vector3d bottom_left = view.corners[first].point_m;
  const Eigen::Vector3d along_x = view.corners[first + 1].point_m - bottom_left;
  const Eigen::Vector3d along_y = view.corners[first + 3].point_m - bottom_left;
  const double edge = along_x.norm();
  if (!(edge > 1e-6) || !(along_y.norm() > 1e-6)) return;
  Eigen::Isometry3d seen_from_tag = Eigen::Isometry3d::Identity();
  seen_from_tag.linear().col(0) = along_x / edge;
  seen_from_tag.linear().col(2) = along_x.cross(along_y).normalized();
  seen_from_tag.linear().col(1) = seen_from_tag.linear().col(2).cross(seen_from_tag.linear().col(0));
  seen_from_tag.translation() = bottom_left + 0.5 * (along_x + along_y);

  // OpenCV wants top left, top right, bottom right, bottom left.
  const double half = 0.5 * edge;
  const std::vector<cv::Point3d> square{
      {-half, half, 0}, {half, half, 0}, {half, -half, 0}, {-half, -half, 0}};
  std::vector<cv::Point2d> image;
  for (const std::size_t corner : {3U, 2U, 1U, 0U}) {
    const auto point = view.camera->unproject(view.corners[first + corner].pixel);
    if (!point) return;
    image.emplace_back(point->x(), point->y());
  }
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::solvePnPGeneric(square, image, cv::Matx33d::eye(), cv::noArray(), rotations, translations, false,
                        cv::SOLVEPNP_IPPE_SQUARE);
  } catch (const cv::Exception&) {
    return;  // Degenerate corners: no candidate
  }
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const Eigen::Vector3d rotation(rotations[i].at<double>(0), rotations[i].at<double>(1),
                                   rotations[i].at<double>(2));
    const Eigen::Vector3d translation(translations[i].at<double>(0), translations[i].at<double>(1),
                                      translations[i].at<double>(2));
    if (!rotation.allFinite() || !translation.allFinite()) continue;
    Eigen::Isometry3d camera_from_tag = Eigen::Isometry3d::Identity();
    camera_from_tag.linear() = rotation_from_vector(rotation).toRotationMatrix();
    camera_from_tag.translation() = translation;
    const Eigen::Isometry3d carrier_from_seen =
        view.carrier_from_camera * camera_from_tag * seen_from_tag.inverse();
    candidates.push_back(view.on == CameraOn::base ? carrier_from_seen : carrier_from_seen.inverse());
  }
}

bool same_minimum(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Quaterniond turn(Eigen::Matrix3d(a.linear() * b.linear().transpose()));
  return vector_from_rotation(turn).norm() < distinct_angle_rad &&
         (a.translation() - b.translation()).norm() < distinct_distance_m;
}

struct Refined {
  BodyPose pose;
  double cost;
};

std::optional<Refined> refine(std::span<const BodyView> views, const Eigen::Isometry3d& start,
                              const std::optional<PosePrior>& prior, const BodyPoseOptions& options) {
  const auto cost = BodyPoseCost::create(views, start, prior, options);
  if (!cost || !reprojection_rms_px(views, start)) return std::nullopt;
  ceres::TinySolver<BodyPoseCost> solver;
  solver.options.max_num_iterations = options.max_iterations;
  solver.options.function_tolerance = options.converged_cost;
  Vector6d motion = Vector6d::Zero();
  solver.Solve(*cost, &motion);

  // What the pose is worth, about the pose itself.
  Refined out;
  BodyPose& pose = out.pose;
  pose.base_from_body = moved(start, motion);
  const auto rms_px = reprojection_rms_px(views, pose.base_from_body);
  const auto at_end = BodyPoseCost::create(views, pose.base_from_body, prior, options);
  if (!rms_px || !at_end) return std::nullopt;
  Eigen::VectorXd residuals(at_end->NumResiduals());
  Eigen::Matrix<double, Eigen::Dynamic, 6> jacobian(at_end->NumResiduals(), 6);
  motion.setZero();
  if (!(*at_end)(motion.data(), residuals.data(), jacobian.data())) return std::nullopt;
  const Eigen::LDLT<Matrix6d> information(jacobian.transpose() * jacobian);
  if (information.info() != Eigen::Success || !information.isPositive()) return std::nullopt;
  pose.covariance = information.solve(Matrix6d::Identity());
  pose.covariance = 0.5 * (pose.covariance + pose.covariance.transpose()).eval();
  pose.reprojection_rms_px = *rms_px;
  for (const BodyView& view : views) {
    pose.tags += static_cast<int>(view.corners.size()) / corners_per_tag;
    pose.views += view.corners.empty() ? 0 : 1;
  }
  pose.ambiguity_ratio = std::numeric_limits<double>::infinity();
  if (!pose.covariance.allFinite() || !pose.base_from_body.matrix().allFinite()) return std::nullopt;
  out.cost = residuals.squaredNorm();
  return out;
}

Error no_pose() {
  return make_error(ErrorCode::failed_precondition, "no pose explains the corners that were seen");
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d out;
  out << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return out;
}

Eigen::Quaterniond rotation_from_vector(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  const double half = 0.5 * angle;
  const double scale = angle > 1e-8 ? std::sin(half) / angle : 0.5;
  Eigen::Quaterniond out;
  out.w() = std::cos(half);
  out.vec() = scale * rotation_rad;
  return out.normalized();
}

Eigen::Vector3d vector_from_rotation(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1.0 : 1.0;
  const double sine = rotation.vec().norm();
  const double angle = 2.0 * std::atan2(sine, sign * rotation.w());
  return sign * rotation.vec() * (sine > 1e-12 ? angle / sine : 2.0);
}

std::array<Eigen::Vector3d, 4> tag_corners(const TagPlacement& tag) {
  const double half = 0.5 * tag.edge_m;
  return {tag.body_from_tag * Eigen::Vector3d(-half, -half, 0),
          tag.body_from_tag * Eigen::Vector3d(half, -half, 0),
          tag.body_from_tag * Eigen::Vector3d(half, half, 0),
          tag.body_from_tag * Eigen::Vector3d(-half, half, 0)};
}

BodyView make_view(const CameraModel& camera, CameraOn on, const Eigen::Isometry3d& carrier_from_camera,
                   std::span<const TagDetection> tags, std::span<const TagPlacement> placements) {
  BodyView view;
  view.camera = &camera;
  view.on = on;
  view.carrier_from_camera = carrier_from_camera;
  for (const TagDetection& tag : tags) {
    const auto placed = std::find_if(placements.begin(), placements.end(),
                                     [&](const TagPlacement& placement) { return placement.id == tag.id; });
    if (placed == placements.end()) continue;
    const auto corners = tag_corners(*placed);
    for (std::size_t i = 0; i < corners.size(); ++i) view.corners.push_back({corners[i], tag.corners_px[i]});
  }
  return view;
}

Result<BodyPose> refine_body_pose(std::span<const BodyView> views, const Eigen::Isometry3d& start,
                                  const std::optional<PosePrior>& prior, const BodyPoseOptions& options) {
  if (Status status = check(views, prior); !status) return status.error();
  if (!start.matrix().allFinite())
    return make_error(ErrorCode::invalid_argument, "found a start that is not finite", "start");
  auto refined = refine(views, start, prior, options);
  if (!refined || refined->pose.reprojection_rms_px > options.max_rms_px) return no_pose();
  return refined->pose;
}

Result<BodyPose> solve_body_pose(std::span<const BodyView> views, const std::optional<PosePrior>& prior,
                                 const BodyPoseOptions& options) {
  if (Status status = check(views, prior); !status) return status.error();
  std::vector<Eigen::Isometry3d> candidates;
  if (prior) candidates.push_back(prior->base_from_body);
  for (const BodyView& view : views)
    for (std::size_t first = 0; first < view.corners.size() && candidates.size() < max_candidates;
         first += corners_per_tag)
      add_square_poses(view, first, candidates);

  // Every candidate against all corners; the best few are refined. The prior has no say before that: it must
  // not keep a start from being tried.
  struct Scored {
    double cost;
    std::size_t index;
  };
  std::vector<Scored> scored;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const auto cost = BodyPoseCost::create(views, candidates[i], std::nullopt, options);
    Eigen::VectorXd residuals(cost->NumResiduals());
    const Vector6d at_start = Vector6d::Zero();
    if ((*cost)(at_start.data(), residuals.data(), nullptr)) scored.push_back({residuals.squaredNorm(), i});
  }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const Scored& a, const Scored& b) { return a.cost < b.cost; });
  if (scored.size() > refined_candidates) scored.resize(refined_candidates);
  std::optional<Refined> best, second;
  for (const Scored& candidate : scored) {
    auto refined = refine(views, candidates[candidate.index], prior, options);
    if (!refined) continue;
    if (best && same_minimum(best->pose.base_from_body, refined->pose.base_from_body)) {
      if (refined->cost < best->cost) best = refined;
      continue;
    }
    if (!best || refined->cost < best->cost) {
      second = best;
      best = refined;
    } else if (!second || refined->cost < second->cost) {
      second = refined;
    }
  }
  if (!best || best->pose.reprojection_rms_px > options.max_rms_px) return no_pose();
  // One squared sigma stands for a perfect fit, lest noise-free views divide by zero.
  if (second) best->pose.ambiguity_ratio = (second->cost + 1.0) / (best->cost + 1.0);
  return best->pose;
}

}  // namespace handloft::tracking
