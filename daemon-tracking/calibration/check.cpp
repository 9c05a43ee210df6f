#include "daemon-tracking/calibration/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "daemon-tracking/vision/body_pose.h"
#include "daemon-tracking/vision/triangulation.h"

namespace handloft::tracking {
namespace {

Verdict graded(double value, double good, double usable) {
  return value <= good ? Verdict::good : value <= usable ? Verdict::usable : Verdict::bad;
}

Verdict worse(Verdict a, Verdict b) {
  return std::max(a, b);
}

std::vector<TagDetection> only(const std::vector<TagDetection>& tags, const std::vector<TagPlacement>& of) {
  std::vector<TagDetection> kept;
  for (const TagDetection& tag : tags)
    if (std::any_of(of.begin(), of.end(), [&](const TagPlacement& placed) { return placed.id == tag.id; }))
      kept.push_back(tag);
  return kept;
}

/// Where a standing camera saw each of the table's corners: (tag, corner) to pixels' sum.
struct Standing {
  Eigen::Vector2d sum{0, 0};
  std::size_t count = 0;
  Eigen::Vector2d mean() const { return sum / static_cast<double>(count); }
};

}  // namespace

Result<CalibrationCheck> check_sights(const Calibration& calibration, const std::vector<TagSight>& sights,
                                      const CheckOptions& options) {
  const Rig& rig = calibration.rig;
  std::vector<CameraModel> models;
  CalibrationCheck made;
  for (const CameraCalibration& camera : rig.cameras) {
    auto model = CameraModel::create(camera.intrinsics);
    if (!model) return model.error();
    models.push_back(*model);
    made.cameras.push_back({camera.name, {}, {}, 0, 0, {}});
  }
  std::vector<std::map<std::pair<int, std::size_t>, Standing>> standing(rig.cameras.size());
  std::vector<double> head_sums(rig.cameras.size(), 0.0), table_sums(rig.cameras.size(), 0.0);
  for (const TagSight& sight : sights) {
    if (sight.camera >= rig.cameras.size())
      return make_error(ErrorCode::invalid_argument, fmt::format("found a frame of camera {}", sight.camera),
                        "sights");
    CameraCheck& to = made.cameras[sight.camera];
    const bool table_camera = rig.cameras[sight.camera].role == CameraRole::table;
    const auto table = only(sight.tags, rig.table_tags), head = only(sight.tags, rig.head_tags);
    if (table_camera) {
      for (const TagDetection& tag : table)
        for (std::size_t i = 0; i < 4; ++i) {
          Standing& corner = standing[sight.camera][{tag.id, i}];
          corner.sum += tag.corners_px[i];
          ++corner.count;
        }
    }
    // Moving: the best pose of this frame alone, so that clocks don't matter.
    const auto& moving = table_camera ? head : table;
    const BodyView view = make_view(models[sight.camera], CameraOn::base, Eigen::Isometry3d::Identity(),
                                    moving, table_camera ? rig.head_tags : rig.table_tags);
    constexpr std::size_t two_tags = 8;
    if (view.corners.size() < two_tags) continue;
    BodyPoseOptions pose_options;
    pose_options.max_rms_px = 1e3;
    const BodyView views[] = {view};
    const auto pose = solve_body_pose(views, std::nullopt, pose_options);
    if (!pose) continue;
    (table_camera ? head_sums : table_sums)[sight.camera] +=
        pose->reprojection_rms_px * pose->reprojection_rms_px;
    ++to.head_frames;
  }

  std::map<std::pair<int, std::size_t>, std::vector<PointView>> rays;
  std::map<std::pair<int, std::size_t>, Eigen::Vector3d> places;
  for (const TagPlacement& tag : rig.table_tags)
    for (std::size_t i = 0; i < 4; ++i) places[{tag.id, i}] = tag_corners(tag)[i];
  bool anything = false;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const CameraCalibration& camera = rig.cameras[c];
    CameraCheck& to = made.cameras[c];
    double sum = 0;
    for (const auto& [key, corner] : standing[c]) {
      if (corner.count < options.least_seen) continue;
      const auto pixel = models[c].project(camera.world_from_camera.inverse() * places[key]);
      // Behind the camera: as wrong as can be.
      sum += pixel ? (*pixel - corner.mean()).squaredNorm() : 1e6;
      ++to.table_corners;
      rays[key].push_back(
          {&models[c], camera.world_from_camera, corner.mean(), Eigen::Matrix2d::Identity() * 0.09});
    }
    if (to.table_corners > 0) to.table_px = std::sqrt(sum / static_cast<double>(to.table_corners));
    const auto frames = static_cast<double>(to.head_frames);
    if (to.head_frames > 0 && camera.role == CameraRole::table) to.head_px = std::sqrt(head_sums[c] / frames);
    if (to.head_frames > 0 && camera.role == CameraRole::head)
      to.table_px = std::sqrt(table_sums[c] / frames);
    StepResult& result = to.result;
    result.unit = "px";
    if (!to.table_px && !to.head_px) {
      result.verdict = Verdict::bad;
      result.words = "it saw no tag: is it plugged in, in focus, and does it look at the table?";
      continue;
    }
    anything = true;
    result.residual = std::max(to.table_px.value_or(0), to.head_px.value_or(0));
    result.verdict = Verdict::good;
    if (to.table_px) result.verdict = graded(*to.table_px, options.good_table_px, options.usable_table_px);
    if (to.head_px)
      result.verdict =
          worse(result.verdict, graded(*to.head_px, options.good_head_px, options.usable_head_px));
    result.words =
        fmt::format("table {}, head {}.", to.table_px ? fmt::format("{:.2f} px", *to.table_px) : "not seen",
                    camera.role == CameraRole::head ? "carries it"
                    : to.head_px                    ? fmt::format("{:.2f} px", *to.head_px)
                                                    : "not seen");
    if (to.table_px && *to.table_px > options.good_table_px)
      result.words += camera.role == CameraRole::table
                          ? " It was moved, or the table's tags were: run extrinsics again."
                          : " Its lens was turned, or the table's tags were moved: run intrinsics.";
    if (to.head_px && *to.head_px > options.good_head_px)
      result.words += " The head rig was bent: run head-rig again.";
  }
  if (!anything)
    return make_error(ErrorCode::failed_precondition, "no camera saw a tag of the table or the head",
                      "check");

  // Views that disagree are what is looked for, no reason to leave a point out.
  TriangulationOptions lenient;
  lenient.max_sigmas = 1e6;
  double sum = 0;
  for (const auto& [key, views] : rays) {
    if (views.size() < 2) continue;
    const auto point = triangulate(views, lenient);
    if (!point) continue;
    sum += (point->position_m - places[key]).squaredNorm();
    ++made.points;
  }
  if (made.points > 0) made.point_m = std::sqrt(sum / static_cast<double>(made.points));
  StepResult& result = made.result;
  result.verdict = Verdict::good;
  for (const CameraCheck& camera : made.cameras) {
    result.verdict = worse(result.verdict, camera.result.verdict);
    result.residual = std::max(result.residual, camera.result.residual);
  }
  if (made.point_m) {
    result.verdict =
        worse(result.verdict, graded(*made.point_m, options.good_point_m, options.usable_point_m));
    result.words = fmt::format("{} corners triangulate to {:.2f} mm.", made.points, 1e3 * *made.point_m);
  } else {
    result.words = "no two cameras see the same corner of the table.";
  }
  return made;
}

}  // namespace handloft::tracking
