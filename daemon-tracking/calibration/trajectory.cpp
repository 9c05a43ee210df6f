#include "daemon-tracking/calibration/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "daemon-tracking/calibration/bundle.h"
#include "daemon-tracking/calibration/least_squares.h"
#include "daemon-tracking/calibration/spline.h"
#include "daemon-tracking/vision/body_pose.h"

namespace handloft::tracking {
namespace {

using Eigen::Index;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

/// What a hand or head can do at most, where no frame says better: 50 m/s^2 and 300 rad/s^2.
constexpr double usual_acceleration_m = 50.0, usual_acceleration_rad = 300.0;
/// Of a frame's first pose: a rig glued by hand is off by centimetres, which are tens of pixels.
constexpr double largest_start_rms_px = 30.0;
constexpr double mean_of_two = 0.5;
/// The standard deviation of what the frames say nothing of.
constexpr double undetermined = 1e9;

Error refused(std::string words) {
  return make_error(ErrorCode::failed_precondition, std::move(words), "trajectory");
}

/// One corner of one frame.
struct Corner {
  std::uint32_t camera;
  double time_s;     ///< Of the frame's stamp, since the start.
  int tag;           ///< Of the body; -1: the table's, seen by the head's own camera.
  Vector3d point_m;  ///< In the tag's frame (body) or the world (table).
  Eigen::Vector2d pixel;
};

struct State {
  PoseSpline spline;
  std::vector<double> offset_s, row_s;
  std::vector<Isometry3d> tags;   ///< body_from_tag
  std::vector<Isometry3d> heads;  ///< head_from_camera, per camera
};

/// What is found; the rest is kept.
struct Layout {
  std::vector<bool> offset, row, tag, head;
  std::vector<bool> tag_seen;
};

Layout lay_out(const TrajectoryInput& input, const TrajectoryOptions& options,
               const std::vector<Corner>& corners) {
  Layout layout;
  std::vector<bool> seen(input.cameras.size(), false);
  std::vector<int> tag_seen(input.body_tags.size(), 0);
  for (const Corner& corner : corners) {
    seen[corner.camera] = true;
    if (corner.tag >= 0) ++tag_seen[static_cast<std::size_t>(corner.tag)];
  }
  // The tag that is seen most carries the body's frame: all together could be anywhere on it.
  const auto anchor = std::max_element(tag_seen.begin(), tag_seen.end()) - tag_seen.begin();
  bool reference = false;  // The first camera's clock is the clock.
  for (std::size_t i = 0; i < input.cameras.size(); ++i) {
    layout.offset.push_back(seen[i] && reference && options.time_offsets == Estimate::find);
    reference = reference || seen[i];
    layout.row.push_back(seen[i] && options.row_times == Estimate::find);
    layout.head.push_back(seen[i] && input.cameras[i].role == CameraRole::head &&
                          options.head_camera == Estimate::find);
  }
  for (std::size_t i = 0; i < tag_seen.size(); ++i) {
    layout.tag_seen.push_back(tag_seen[i] > 0);
    layout.tag.push_back(tag_seen[i] > 0 && static_cast<std::ptrdiff_t>(i) != anchor &&
                         options.body_tags == Estimate::find);
  }
  return layout;
}

/// Rows below the picture's middle: where a rolling shutter's stamp holds.
double row_of(const CameraCalibration& camera, const Corner& corner) {
  return corner.pixel.y() - mean_of_two * (camera.intrinsics.height_px - 1);
}

/// A corner of one frame: (seen - expected) in sigmas. Blocks: its tag's or head camera's pose, the camera's
/// offset, its row time, then the controls that the frame's time may come to depend on.
class MovingCornerCost final : public ceres::CostFunction {
 public:
  MovingCornerCost(const CameraCalibration& camera, const Corner& corner, const PoseSpline& spline,
                   std::size_t window, std::size_t controls, double sigma_px, double largest_offset_s)
      : intrinsics_(camera.intrinsics),
        camera_from_world_(camera.world_from_camera.inverse()),
        corner_(corner),
        spline_(spline),
        window_(window),
        row_(row_of(camera, corner)),
        weight_(1.0 / sigma_px),
        largest_offset_s_(largest_offset_s) {
    set_num_residuals(2);
    *mutable_parameter_block_sizes() = {pose_block_size, 1, 1};
    mutable_parameter_block_sizes()->insert(mutable_parameter_block_sizes()->end(), controls, control_size);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double offset_s = *parameters[1];
    if (std::abs(offset_s) > largest_offset_s_) return false;
    const std::size_t controls = parameter_block_sizes().size() - first_control;
    const auto body = spline_.at(corner_.time_s + offset_s + row_ * *parameters[2], window_,
                                 std::span(parameters + first_control, controls));
    if (!body) return false;
    const Isometry3d pose = pose_of(parameters[0]);
    Vector3d in_body, in_world, in_camera;
    if (corner_.tag >= 0) {
      in_body = pose * corner_.point_m;
      in_world = body->pose * in_body;
      in_camera = camera_from_world_ * in_world;
    } else {
      in_world = corner_.point_m;
      in_body = body->pose.inverse() * in_world;
      in_camera = pose.inverse() * in_body;
    }
    const auto lens = project_through(intrinsics_, in_camera);
    if (!lens) return false;
    Eigen::Map<Eigen::Vector2d>{residuals} = weight_ * (corner_.pixel - lens->pixel);
    if (jacobians == nullptr) return true;

    const Matrix23 by_point = -weight_ * lens->by_point;
    Matrix23 by_shift;  // d residual / d (body's translation)
    Eigen::Matrix<double, 2, pose_motion_size> by_pose;
    if (corner_.tag >= 0) {
      by_shift = by_point * camera_from_world_.linear();
      const Matrix23 by_body = by_shift * body->pose.linear();
      by_pose << by_body, -by_body * skew(in_body - pose.translation());
    } else {
      const Matrix23 by_body = by_point * pose.linear().transpose();
      by_shift = -by_body * body->pose.linear().transpose();
      by_pose << -by_body, by_body * skew(in_body - pose.translation());
    }
    // By the body's small left rotation.
    const Matrix23 by_turn = -by_shift * skew(in_world - body->pose.translation());
    const Eigen::Vector2d by_time = by_shift * body->velocity_m_s + by_turn * body->angular_rad_s;
    if (jacobians[0] != nullptr)
      Eigen::Map<Eigen::Matrix<double, 2, pose_block_size, Eigen::RowMajor>>{jacobians[0]} =
          by_pose * motion_by_block(parameters[0]);
    if (jacobians[1] != nullptr) Eigen::Map<Eigen::Vector2d>{jacobians[1]} = by_time;
    if (jacobians[2] != nullptr) Eigen::Map<Eigen::Vector2d>{jacobians[2]} = row_ * by_time;
    Eigen::Matrix<double, 2, control_size> by_value;
    by_value << by_shift, by_turn * body->left_jacobian;
    for (std::size_t i = 0; i < controls; ++i) {
      if (jacobians[first_control + i] == nullptr) continue;
      const std::size_t from_first = window_ + i - body->first;  // Huge for those before it.
      const double weight = from_first < body->weights.size() ? body->weights[from_first] : 0.0;
      Eigen::Map<Eigen::Matrix<double, 2, control_size, Eigen::RowMajor>>{jacobians[first_control + i]} =
          weight * by_value;
    }
    return true;
  }

  static constexpr int control_size = 6;

 private:
  static constexpr std::size_t first_control = 3;
  CameraIntrinsics intrinsics_;
  Isometry3d camera_from_world_;
  Corner corner_;
  const PoseSpline& spline_;
  std::size_t window_;
  double row_, weight_, largest_offset_s_;
};

/// Three controls in a row: the acceleration between them, in usual ones.
class BendCost final : public ceres::SizedCostFunction<6, 6, 6, 6> {
 public:
  explicit BendCost(double knot_s) {
    const double h2 = knot_s * knot_s;
    weights_.head<3>().setConstant(1.0 / (usual_acceleration_m * h2));
    weights_.tail<3>().setConstant(1.0 / (usual_acceleration_rad * h2));
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    using Control = PoseSpline::Control;
    Eigen::Map<Control> bend(residuals);
    bend.setZero();
    for (std::size_t i = 0; i < factors.size(); ++i)
      bend += factors[i] * weights_.cwiseProduct(Eigen::Map<const Control>(parameters[i]));
    for (std::size_t i = 0; jacobians != nullptr && i < factors.size(); ++i)
      if (jacobians[i] != nullptr)
        Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>{jacobians[i]} =
            Eigen::Matrix<double, 6, 6>((factors[i] * weights_).asDiagonal());
    return true;
  }

 private:
  static constexpr std::array<double, 3> factors{1.0, -2.0, 1.0};
  PoseSpline::Control weights_;
};

/// The state as Ceres sees it.
class Problem {
 public:
  Problem(const TrajectoryInput& input, const TrajectoryOptions& options, const std::vector<Corner>& corners,
          const Layout& layout, State& state)
      : state_(state), offset_at_start_(state.offset_s) {
    for (const Isometry3d& tag : state.tags) tags_.push_back(block_of(tag));
    for (const Isometry3d& head : state.heads) heads_.push_back(block_of(head));
    std::vector<PoseSpline::Control>& controls = state.spline.controls();
    for (auto& control : controls) ceres_.AddParameterBlock(control.data(), MovingCornerCost::control_size);
    free_ = MovingCornerCost::control_size * controls.size();
    // One knot to either side, where a clock or a row time is yet to be found.
    constexpr std::size_t order = 4;
    ceres::LossFunction* loss = corners.empty() ? nullptr : huber_loss(options.huber_sigmas).release();
    for (const Corner& corner : corners) {
      const std::uint32_t camera = corner.camera;
      const CameraCalibration& calibration = input.cameras[camera];
      const std::size_t first = state.spline.first_at(corner.time_s + state.offset_s[camera] +
                                                      row_of(calibration, corner) * state.row_s[camera]);
      const std::size_t spare = layout.offset[camera] || layout.row[camera] ? 1 : 0;
      const std::size_t begin = first - std::min(first, spare);
      const std::size_t end = std::min(controls.size(), first + order + spare);
      double* pose =
          corner.tag >= 0 ? tags_[static_cast<std::size_t>(corner.tag)].data() : heads_[camera].data();
      std::vector<double*> blocks{pose, &state.offset_s[camera], &state.row_s[camera]};
      for (std::size_t i = begin; i < end; ++i) blocks.push_back(controls[i].data());
      ceres_.AddResidualBlock(
          std::make_unique<MovingCornerCost>(calibration, corner, state.spline, begin, end - begin,
                                             options.corner_sigma_px, options.largest_offset_s)
              .release(),
          loss, blocks);
    }
    for (std::size_t i = 0; i + 2 < controls.size(); ++i)
      ceres_.AddResidualBlock(std::make_unique<BendCost>(state.spline.knot_s()).release(), nullptr,
                              controls[i].data(), controls[i + 1].data(), controls[i + 2].data());
    for (std::size_t i = 0; i < tags_.size(); ++i) {
      hold(tags_[i].data(), layout.tag[i]);
      if (layout.tag[i])
        ceres_.AddResidualBlock(std::make_unique<PosePriorCost>(input.body_tags[i].body_from_tag,
                                                                options.body_sigma_m, options.body_sigma_rad)
                                    .release(),
                                nullptr, tags_[i].data());
    }
    for (std::size_t i = 0; i < heads_.size(); ++i) {
      hold(heads_[i].data(), layout.head[i]);
      hold_number(&state.offset_s[i], layout.offset[i]);
      hold_number(&state.row_s[i], layout.row[i]);
    }
  }

  std::optional<LeastSquaresOutcome> solve(const LeastSquaresOptions& options) {
    auto outcome = minimise(ceres_, options);
    for (std::size_t i = 0; i < tags_.size(); ++i) state_.tags[i] = pose_of(tags_[i].data());
    for (std::size_t i = 0; i < heads_.size(); ++i) state_.heads[i] = pose_of(heads_[i].data());
    return outcome;
  }

  /// How far the farthest clock went since this problem was laid out.
  double moved_s() const {
    double most = 0;
    for (std::size_t i = 0; i < offset_at_start_.size(); ++i)
      most = std::max(most, std::abs(state_.offset_s[i] - offset_at_start_[i]));
    return most;
  }

  std::size_t unknowns() const { return free_; }
  const double* tag(std::size_t i) const { return tags_[i].data(); }
  ceres::Problem& ceres() { return ceres_; }

 private:
  void hold(double* pose, bool find) {
    if (!ceres_.HasParameterBlock(pose)) return;
    ceres_.SetManifold(pose, std::make_unique<PoseManifold>().release());
    if (find)
      free_ += pose_motion_size;
    else
      ceres_.SetParameterBlockConstant(pose);
  }
  void hold_number(double* number, bool find) {
    if (!ceres_.HasParameterBlock(number)) return;
    if (find)
      ++free_;
    else
      ceres_.SetParameterBlockConstant(number);
  }

  State& state_;
  std::vector<double> offset_at_start_;
  std::vector<PoseBlock> tags_, heads_;
  ceres::Problem ceres_;
  std::size_t free_ = 0;
};

struct Seen {
  Eigen::Vector2d residual;
  double speed_px_s;
};

/// A corner in the solution.
std::optional<Seen> see(const TrajectoryInput& input, const State& state, const Corner& corner) {
  const CameraCalibration& camera = input.cameras[corner.camera];
  const SplinePoint body = state.spline.at(corner.time_s + state.offset_s[corner.camera] +
                                           row_of(camera, corner) * state.row_s[corner.camera]);
  const Vector3d in_world =
      corner.tag >= 0 ? body.pose * (state.tags[static_cast<std::size_t>(corner.tag)] * corner.point_m)
                      : corner.point_m;
  const Vector3d in_camera = corner.tag >= 0
                                 ? camera.world_from_camera.inverse() * in_world
                                 : state.heads[corner.camera].inverse() * (body.pose.inverse() * in_world);
  const auto lens = project_through(camera.intrinsics, in_camera);
  if (!lens) return std::nullopt;
  const Vector3d motion = body.velocity_m_s + body.angular_rad_s.cross(in_world - body.pose.translation());
  return Seen{corner.pixel - lens->pixel, lens->by_point.norm() / std::sqrt(2.0) * motion.norm()};
}

const TagPlacement* placement_of(const std::vector<TagPlacement>& tags, int id) {
  const auto found =
      std::find_if(tags.begin(), tags.end(), [id](const TagPlacement& tag) { return tag.id == id; });
  return found == tags.end() ? nullptr : &*found;
}

/// The stretch of at most `longest_s` in which corners moved most.
std::pair<double, double> liveliest(const std::vector<TimedPose>& poses, double longest_s) {
  const double end = poses.back().time_s;
  if (end - poses.front().time_s <= longest_s) return {poses.front().time_s, end};
  double best = -1, begin = poses.front().time_s;
  for (std::size_t i = 0; i < poses.size(); i += std::max<std::size_t>(1, poses.size() / 50)) {
    if (poses[i].time_s + longest_s > end) break;
    double way = 0;
    for (std::size_t j = i + 1; j < poses.size() && poses[j].time_s <= poses[i].time_s + longest_s; ++j)
      way += (poses[j].pose.translation() - poses[j - 1].pose.translation()).norm();
    if (way <= best) continue;
    best = way;
    begin = poses[i].time_s;
  }
  return {begin, begin + longest_s};
}

}  // namespace

bool worth_using(const CameraTiming& timing) {
  constexpr double significant = 2.0;
  return timing.result.verdict == Verdict::good ||
         (timing.result.verdict == Verdict::usable &&
          std::abs(timing.offset_s) > significant * timing.offset_sigma_s);
}

Result<TrajectoryCalibration> calibrate_on_the_move(const TrajectoryInput& input,
                                                    const TrajectoryOptions& options) {
  std::vector<CameraModel> models;
  for (const CameraCalibration& camera : input.cameras) {
    auto model = CameraModel::create(camera.intrinsics);
    if (!model) return model.error();
    models.push_back(*model);
  }
  if (input.sights.empty())
    return refused("no camera saw a tag of the head: is it within their sight, and are the tags as printed?");
  TimePoint start = input.sights.front().time;
  for (const TagSight& sight : input.sights) {
    if (sight.camera >= input.cameras.size())
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found a frame of camera {}, expected 0 to {}", sight.camera, input.cameras.size() - 1),
          "sights");
    start = std::min(start, sight.time);
  }
  // The body's pose in each frame of a table camera by itself.
  std::vector<TimedPose> poses;
  std::vector<double> sight_s;
  for (const TagSight& sight : input.sights) {
    sight_s.push_back(to_seconds(sight.time - start));
    const CameraCalibration& camera = input.cameras[sight.camera];
    if (camera.role != CameraRole::table) continue;
    const BodyView view = make_view(models[sight.camera], CameraOn::base, camera.world_from_camera,
                                    sight.tags, input.body_tags);
    constexpr std::size_t two_tags = 8;
    if (view.corners.size() < two_tags) continue;
    BodyPoseOptions pose_options;
    pose_options.max_rms_px = largest_start_rms_px;
    const BodyView views[] = {view};
    if (const auto pose = solve_body_pose(views, std::nullopt, pose_options))
      poses.push_back({sight_s.back(), pose->base_from_body});
  }
  if (poses.size() < options.min_sights)
    return refused(
        fmt::format("the head's pose is known in {} frames (two of its tags or more seen by a table camera, "
                    "where the drawing has them), expected at least {}: stay in sight for longer",
                    poses.size(), options.min_sights));
  std::stable_sort(poses.begin(), poses.end(),
                   [](const TimedPose& a, const TimedPose& b) { return a.time_s < b.time_s; });
  const auto [begin_s, end_s] = liveliest(poses, options.longest_s);
  std::erase_if(poses, [begin = begin_s, end = end_s](const TimedPose& pose) {
    return pose.time_s < begin || pose.time_s > end;
  });

  State state{PoseSpline(begin_s, end_s, options.knot_s, poses),
              std::vector<double>(input.cameras.size(), 0.0),
              std::vector<double>(input.cameras.size(), 0.0),
              {},
              {}};
  for (const TagPlacement& tag : input.body_tags) state.tags.push_back(tag.body_from_tag);
  for (std::size_t i = 0; i < input.cameras.size(); ++i) {
    state.heads.push_back(input.cameras[i].head_from_camera);
    state.row_s[i] = to_seconds(input.cameras[i].row_time);
  }

  std::vector<Corner> corners;
  std::vector<bool> head_placed(input.cameras.size(), false);
  for (std::size_t s = 0; s < input.sights.size(); ++s) {
    const TagSight& sight = input.sights[s];
    if (sight_s[s] < begin_s || sight_s[s] > end_s) continue;
    const bool of_table = input.cameras[sight.camera].role == CameraRole::head;
    if (of_table && options.head_camera == Estimate::find && !head_placed[sight.camera]) {
      // Where the head's camera begins: from one frame, and the head's pose then.
      const BodyView view = make_view(models[sight.camera], CameraOn::body, Isometry3d::Identity(),
                                      sight.tags, input.table_tags);
      const BodyView views[] = {view};
      if (const auto eye = solve_body_pose(views, std::nullopt)) {
        state.heads[sight.camera] = state.spline.at(sight_s[s]).pose.inverse() * eye->base_from_body;
        head_placed[sight.camera] = true;
      }
    }
    for (const TagDetection& tag : sight.tags) {
      const TagPlacement* placed = placement_of(of_table ? input.table_tags : input.body_tags, tag.id);
      if (placed == nullptr) continue;
      TagPlacement alone = *placed;
      if (!of_table) alone.body_from_tag = Isometry3d::Identity();
      const auto points = tag_corners(alone);
      for (std::size_t i = 0; i < points.size(); ++i)
        corners.push_back({sight.camera, sight_s[s],
                           of_table ? -1 : static_cast<int>(placed - input.body_tags.data()), points[i],
                           tag.corners_px[i]});
    }
  }

  const Layout layout = lay_out(input, options, corners);
  LeastSquaresOptions solver_options;
  solver_options.solver = LinearSolver::sparse_cholesky;
  solver_options.max_iterations = 50;
  solver_options.converged_share = 1e-6;
  std::unique_ptr<Problem> problem;
  // A clock that goes farther than a knot comes to other controls: laid out anew from there.
  constexpr int most_layouts = 8;
  for (int round = 0; round < most_layouts; ++round) {
    problem = std::make_unique<Problem>(input, options, corners, layout, state);
    if (!problem->solve(solver_options))
      return refused(
          "the frames contradict each other from the start: are the cameras where the calibration says?");
    if (problem->moved_s() < mean_of_two * options.knot_s) break;
  }

  TrajectoryCalibration made;
  made.cameras.resize(input.cameras.size());
  std::vector<double> sums(input.cameras.size(), 0.0);
  double sum = 0, speed = 0;
  for (const Corner& corner : corners) {
    const auto seen = see(input, state, corner);
    if (!seen) continue;
    sums[corner.camera] += seen->residual.squaredNorm();
    sum += seen->residual.squaredNorm();
    ++made.cameras[corner.camera].corners;
    speed += seen->speed_px_s;
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, corners.size()));
  made.rms_px = std::sqrt(sum / count);
  made.speed_px_s = speed / count;

  std::vector<AskedBlock> asked;
  for (std::size_t i = 0; i < input.body_tags.size(); ++i)
    if (layout.tag[i]) asked.push_back({problem->tag(i), pose_motion_size});
  for (std::size_t i = 0; i < input.cameras.size(); ++i) {
    if (layout.offset[i]) asked.push_back({&state.offset_s[i], 1});
    if (layout.row[i]) asked.push_back({&state.row_s[i], 1});
  }
  const auto found = covariances(problem->ceres(), asked);
  // Corners of a tag err together (blur, light): the stated sigma is that of the residuals (sigma_0), not
  // less than what a corner is good for.
  const double freedom = std::max(1.0, 2.0 * count - static_cast<double>(problem->unknowns()));
  const double unit = std::max(1.0, std::sqrt(sum / freedom) / options.corner_sigma_px);
  std::size_t next = 0;
  const auto sigma = [&](bool is_asked, Index coordinates) {
    if (!is_asked) return 0.0;
    const std::size_t at = next++;
    return found ? unit * std::sqrt((*found)[at].diagonal().head(coordinates).sum()) : undetermined;
  };

  std::vector<Vector3d> measured, nominal;
  for (std::size_t i = 0; i < input.body_tags.size(); ++i) {
    TagPlacement tag = input.body_tags[i];
    for (const Vector3d& point : tag_corners(tag)) nominal.push_back(point);
    tag.body_from_tag = state.tags[i];
    for (const Vector3d& point : tag_corners(tag)) measured.push_back(point);
  }
  const Isometry3d shift =
      options.body_tags == Estimate::find ? best_motion(measured, nominal) : Isometry3d::Identity();
  made.body_tags = input.body_tags;
  double worst_tag_sigma = 0;
  int worst_tag = 0;
  std::string unseen;
  for (std::size_t i = 0; i < made.body_tags.size(); ++i) {
    made.body_tags[i].body_from_tag = shift * state.tags[i];
    made.tag_sigma_m.push_back(std::nullopt);
    if (!layout.tag_seen[i]) {
      unseen += fmt::format("{}{}", unseen.empty() ? "" : ", ", made.body_tags[i].id);
      continue;
    }
    made.tag_sigma_m.back() = sigma(layout.tag[i], 3);
    if (*made.tag_sigma_m.back() <= worst_tag_sigma) continue;
    worst_tag_sigma = *made.tag_sigma_m.back();
    worst_tag = made.body_tags[i].id;
  }
  for (std::size_t i = 0; i < input.cameras.size(); ++i) {
    CameraTiming& timing = made.cameras[i];
    made.head_from_camera.push_back(input.cameras[i].role == CameraRole::head
                                        ? shift * state.heads[i]
                                        : input.cameras[i].head_from_camera);
    timing.offset_s = state.offset_s[i];
    timing.offset_sigma_s = sigma(layout.offset[i], 1);
    timing.row_s = state.row_s[i];
    timing.row_sigma_s = sigma(layout.row[i], 1);
    timing.rms_px = timing.corners > 0 ? std::sqrt(sums[i] / static_cast<double>(timing.corners)) : 0.0;
    StepResult& result = timing.result;
    result.residual = 1e3 * timing.offset_sigma_s;
    result.unit = "ms";
    const bool known = timing.corners > 0;
    result.verdict = !known || timing.offset_sigma_s > options.usable_offset_sigma_s ? Verdict::bad
                     : timing.offset_sigma_s <= options.good_offset_sigma_s          ? Verdict::good
                                                                                     : Verdict::usable;
    result.words = known ? fmt::format("its clock differs by {:.2f} +- {:.2f} ms.{}", 1e3 * timing.offset_s,
                                       1e3 * timing.offset_sigma_s,
                                       result.verdict == Verdict::good ? "" : " Move the head faster.")
                         : "it did not see the head move.";
  }
  made.result.residual = made.rms_px;
  const bool good = made.rms_px <= options.good_rms_px && worst_tag_sigma <= options.good_tag_sigma_m;
  const bool usable = made.rms_px <= options.usable_rms_px && worst_tag_sigma <= options.usable_tag_sigma_m;
  made.result.verdict = good ? Verdict::good : usable ? Verdict::usable : Verdict::bad;
  std::string advice;
  if (made.rms_px > options.good_rms_px) advice += " Is the rig stiff, and are the tags flat?";
  if (worst_tag_sigma > options.good_tag_sigma_m)
    advice += fmt::format(" Tag {} is known to {:.1f} mm only: turn it to the cameras for longer.", worst_tag,
                          1e3 * worst_tag_sigma);
  if (!unseen.empty()) advice += fmt::format(" Not seen, and left where said to be: tag {}.", unseen);
  made.result.words = fmt::format("{:.2f} px over {} corners in {:.1f} s; corners moved at {:.0f} px/s.{}",
                                  made.rms_px, corners.size(), end_s - begin_s, made.speed_px_s, advice);
  return made;
}

}  // namespace handloft::tracking
