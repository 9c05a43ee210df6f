#include "daemon-tracking/calibration/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "daemon-tracking/calibration/bundle.h"
#include "daemon-tracking/calibration/least_squares.h"
#include "daemon-tracking/calibration/spline.h"
#include "daemon-tracking/vision/body_pose.h"
#include "daemon-tracking/vision/reprojection.h"

namespace handloft::tracking {
namespace {

using Block = NormalEquations::Block;
using Eigen::Index;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

/// What a hand or head can do at most, where no frame says better: 50 m/s^2 and 300 rad/s^2.
constexpr double usual_acceleration_m = 50.0, usual_acceleration_rad = 300.0;
constexpr double largest_start_rms_px = 8.0;
constexpr double mean_of_two = 0.5;

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

/// Where unknowns begin; -1: kept.
struct Layout {
  Index controls = 0;
  std::vector<Index> offset, row, tag, head;
  Index unknowns = 0;
};

class Problem {
 public:
  Problem(const TrajectoryInput& input, const TrajectoryOptions& options, std::vector<Corner> corners,
          State state)
      : input_(input),
        options_(options),
        corners_(std::move(corners)),
        state_(std::move(state)),
        before_(state_),
        starts_(state_.tags) {
    lay_out();
  }

  struct Seen {
    Eigen::Vector2d residual;
    LensProjection lens;
    SplinePoint body;
    Vector3d in_body, in_world;
  };
  std::optional<Seen> see(const Corner& corner) const {
    const CameraCalibration& camera = input_.cameras[corner.camera];
    const double row = corner.pixel.y() - mean_of_two * (camera.intrinsics.height_px - 1);
    Seen seen;
    seen.body =
        state_.spline.at(corner.time_s + state_.offset_s[corner.camera] + row * state_.row_s[corner.camera]);
    Vector3d in_camera;
    if (corner.tag >= 0) {
      seen.in_body = state_.tags[static_cast<std::size_t>(corner.tag)] * corner.point_m;
      seen.in_world = seen.body.pose * seen.in_body;
      in_camera = camera.world_from_camera.inverse() * seen.in_world;
    } else {
      seen.in_world = corner.point_m;
      seen.in_body = seen.body.pose.inverse() * seen.in_world;
      in_camera = state_.heads[corner.camera].inverse() * seen.in_body;
    }
    const auto lens = project_through(camera.intrinsics, in_camera);
    if (!lens) return std::nullopt;
    seen.lens = *lens;
    seen.residual = corner.pixel - lens->pixel;
    return seen;
  }

  std::optional<double> evaluate(NormalEquations* equations) const {
    const double information = 1.0 / (options_.corner_sigma_px * options_.corner_sigma_px);
    double cost = 0;
    std::vector<Block> blocks;
    for (const Corner& corner : corners_) {
      const auto seen = see(corner);
      if (!seen) return std::nullopt;
      const HuberLoss loss = huber(seen->residual.squaredNorm() * information, options_.huber_sigmas);
      cost += loss.loss;
      if (equations == nullptr) continue;
      derive(corner, *seen, blocks);
      equations->add(blocks, seen->residual, loss.weight * information);
    }
    return cost + smooth(equations) + hold_tags(equations);
  }

  void apply(const Eigen::VectorXd& step) {
    before_ = state_;
    for (std::size_t i = 0; i < state_.spline.controls().size(); ++i)
      state_.spline.controls()[i] += step.segment<6>(6 * static_cast<Index>(i));
    for (std::size_t i = 0; i < input_.cameras.size(); ++i) {
      if (layout_.offset[i] >= 0)
        state_.offset_s[i] = std::clamp(state_.offset_s[i] + step[layout_.offset[i]],
                                        -options_.largest_offset_s, options_.largest_offset_s);
      if (layout_.row[i] >= 0) state_.row_s[i] += step[layout_.row[i]];
      if (layout_.head[i] >= 0) state_.heads[i] = moved(state_.heads[i], step.segment<6>(layout_.head[i]));
    }
    for (std::size_t i = 0; i < state_.tags.size(); ++i)
      if (layout_.tag[i] >= 0) state_.tags[i] = moved(state_.tags[i], step.segment<6>(layout_.tag[i]));
  }
  void undo() { state_ = before_; }

  const State& state() const { return state_; }
  const Layout& layout() const { return layout_; }
  const std::vector<Corner>& corners() const { return corners_; }

 private:
  void lay_out() {
    Index& next = layout_.unknowns;
    next = 6 * static_cast<Index>(state_.spline.controls().size());
    std::vector<bool> seen(input_.cameras.size(), false);
    std::vector<int> tag_seen(state_.tags.size(), 0);
    for (const Corner& corner : corners_) {
      seen[corner.camera] = true;
      if (corner.tag >= 0) ++tag_seen[static_cast<std::size_t>(corner.tag)];
    }
    // The tag that is seen most carries the body's frame: all together could be anywhere on it.
    const auto anchor = std::max_element(tag_seen.begin(), tag_seen.end()) - tag_seen.begin();
    bool reference = false;  // The first camera's clock is the clock.
    for (std::size_t i = 0; i < input_.cameras.size(); ++i) {
      const bool offset = seen[i] && reference && options_.time_offsets == Estimate::find;
      reference = reference || seen[i];
      layout_.offset.push_back(offset ? next++ : -1);
      layout_.row.push_back(seen[i] && options_.row_times == Estimate::find ? next++ : -1);
      const bool head =
          seen[i] && input_.cameras[i].role == CameraRole::head && options_.head_camera == Estimate::find;
      layout_.head.push_back(head ? next : -1);
      if (head) next += 6;
    }
    for (std::size_t i = 0; i < state_.tags.size(); ++i) {
      const bool find =
          tag_seen[i] > 0 && static_cast<std::ptrdiff_t>(i) != anchor && options_.body_tags == Estimate::find;
      layout_.tag.push_back(find ? next : -1);
      if (find) next += 6;
    }
  }

  void derive(const Corner& corner, const Seen& seen, std::vector<Block>& blocks) const {
    blocks.clear();
    const CameraCalibration& camera = input_.cameras[corner.camera];
    const SplinePoint& body = seen.body;
    Matrix23 by_shift, by_turn;  // d pixel / d (body's translation), / d (its small left rotation)
    if (corner.tag >= 0) {
      by_shift = seen.lens.by_point * camera.world_from_camera.linear().transpose();
      by_turn = -by_shift * skew(seen.in_world - body.pose.translation());
      const Index tag = layout_.tag[static_cast<std::size_t>(corner.tag)];
      if (tag >= 0) {
        const Matrix23 by_body = by_shift * body.pose.linear();
        Eigen::Matrix<double, 2, 6> by_tag;
        by_tag << by_body,
            -by_body * skew(seen.in_body - state_.tags[static_cast<std::size_t>(corner.tag)].translation());
        blocks.push_back({tag, -by_tag});
      }
    } else {
      const Isometry3d& head = state_.heads[corner.camera];
      const Matrix23 by_body = seen.lens.by_point * head.linear().transpose();
      by_shift = -by_body * body.pose.linear().transpose();
      by_turn = -by_shift * skew(seen.in_world - body.pose.translation());
      if (layout_.head[corner.camera] >= 0) {
        Eigen::Matrix<double, 2, 6> by_head;
        by_head << -by_body, by_body * skew(seen.in_body - head.translation());
        blocks.push_back({layout_.head[corner.camera], -by_head});
      }
    }
    const Matrix23 by_vector = by_turn * body.left_jacobian;
    for (std::size_t i = 0; i < 4; ++i) {
      Eigen::Matrix<double, 2, 6> by_control;
      by_control << body.weights[i] * by_shift, body.weights[i] * by_vector;
      blocks.push_back({6 * static_cast<Index>(body.first + i), -by_control});
    }
    const Eigen::Vector2d by_time = by_shift * body.velocity_m_s + by_turn * body.angular_rad_s;
    if (layout_.offset[corner.camera] >= 0) blocks.push_back({layout_.offset[corner.camera], -by_time});
    if (layout_.row[corner.camera] >= 0) {
      const double row = corner.pixel.y() - mean_of_two * (camera.intrinsics.height_px - 1);
      blocks.push_back({layout_.row[corner.camera], -by_time * row});
    }
  }

  double smooth(NormalEquations* equations) const {
    const auto& controls = state_.spline.controls();
    const double h2 = state_.spline.knot_s() * state_.spline.knot_s();
    double cost = 0;
    for (std::size_t i = 0; i + 2 < controls.size(); ++i) {
      const PoseSpline::Control bend = controls[i] - 2 * controls[i + 1] + controls[i + 2];
      for (Index pair = 0; pair < 3; ++pair) {
        const double usual = (pair == 0 ? usual_acceleration_m : usual_acceleration_rad) * h2;
        // Coordinates 0, 1 and 2, 3 and 4, 5; the middle pair is half translation: the looser bound does.
        const double information = 1.0 / (usual * usual);
        const Eigen::Vector2d residual = -bend.segment<2>(2 * pair);
        cost += residual.squaredNorm() * information;
        if (equations == nullptr) continue;
        std::array<Block, 3> blocks;
        for (std::size_t j = 0; j < 3; ++j)
          blocks[j] = {6 * static_cast<Index>(i + j) + 2 * pair,
                       (j == 1 ? 2.0 : -1.0) * Eigen::Matrix2d::Identity()};
        equations->add(blocks, residual, information);
      }
    }
    return cost;
  }

  double hold_tags(NormalEquations* equations) const {
    double cost = 0;
    for (std::size_t i = 0; i < state_.tags.size(); ++i) {
      if (layout_.tag[i] < 0) continue;
      Eigen::Matrix<double, 6, 1> step;
      step << starts_[i].translation() - state_.tags[i].translation(),
          vector_from_rotation(Eigen::Quaterniond(starts_[i].linear() * state_.tags[i].linear().transpose()));
      for (Index j = 0; j < 6; ++j) {
        const double sigma = j < 3 ? options_.body_sigma_m : options_.body_sigma_rad;
        cost += step[j] * step[j] / (sigma * sigma);
        if (equations != nullptr) equations->add_prior(layout_.tag[i] + j, step[j], 1.0 / (sigma * sigma));
      }
    }
    return cost;
  }

  const TrajectoryInput& input_;
  const TrajectoryOptions& options_;
  std::vector<Corner> corners_;
  State state_, before_;
  std::vector<Isometry3d> starts_;
  Layout layout_;
};

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

  Problem problem(input, options, std::move(corners), std::move(state));
  LeastSquaresProblem solver;
  solver.unknowns = problem.layout().unknowns;
  solver.evaluate = [&](NormalEquations* equations) { return problem.evaluate(equations); };
  solver.apply = [&](const Eigen::VectorXd& step) { problem.apply(step); };
  solver.undo = [&] { problem.undo(); };
  LeastSquaresOptions solver_options;
  solver_options.max_iterations = 25;
  solver_options.converged_share = 1e-6;
  const auto solved = minimise(solver, solver_options);
  if (!solved)
    return refused(
        "the frames contradict each other from the start: are the cameras where the calibration says?");

  TrajectoryCalibration made;
  made.cameras.resize(input.cameras.size());
  std::vector<double> sums(input.cameras.size(), 0.0);
  double sum = 0, speed = 0;
  for (const Corner& corner : problem.corners()) {
    const auto seen = problem.see(corner);
    if (!seen) continue;
    sums[corner.camera] += seen->residual.squaredNorm();
    sum += seen->residual.squaredNorm();
    ++made.cameras[corner.camera].corners;
    const Vector3d motion = seen->body.velocity_m_s +
                            seen->body.angular_rad_s.cross(seen->in_world - seen->body.pose.translation());
    speed += (seen->lens.by_point.norm() / std::sqrt(2.0)) * motion.norm();
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, problem.corners().size()));
  made.rms_px = std::sqrt(sum / count);
  made.speed_px_s = speed / count;

  NormalEquations equations(problem.layout().unknowns);
  std::optional<Eigen::MatrixXd> covariance;
  if (problem.evaluate(&equations)) covariance = equations.covariance();
  // Corners of a tag err together (blur, light): the stated sigma is that of the residuals, not less.
  const double unit = std::max(1.0, made.rms_px / (std::sqrt(2.0) * options.corner_sigma_px));
  const auto sigma = [&](Index at) {
    return at < 0 ? 0.0 : covariance ? unit * std::sqrt((*covariance)(at, at)) : 1e9;
  };

  const State& found = problem.state();
  std::vector<Vector3d> measured, nominal;
  for (std::size_t i = 0; i < input.body_tags.size(); ++i) {
    TagPlacement tag = input.body_tags[i];
    for (const Vector3d& point : tag_corners(tag)) nominal.push_back(point);
    tag.body_from_tag = found.tags[i];
    for (const Vector3d& point : tag_corners(tag)) measured.push_back(point);
  }
  const Isometry3d shift =
      options.body_tags == Estimate::find ? best_motion(measured, nominal) : Isometry3d::Identity();
  made.body_tags = input.body_tags;
  double worst_tag_sigma = 0;
  for (std::size_t i = 0; i < made.body_tags.size(); ++i) {
    made.body_tags[i].body_from_tag = shift * found.tags[i];
    const Index at = problem.layout().tag[i];
    made.tag_sigma_m.push_back(at < 0 ? 0.0
                                      : std::sqrt(sigma(at) * sigma(at) + sigma(at + 1) * sigma(at + 1) +
                                                  sigma(at + 2) * sigma(at + 2)));
    worst_tag_sigma = std::max(worst_tag_sigma, made.tag_sigma_m.back());
  }
  for (std::size_t i = 0; i < input.cameras.size(); ++i) {
    CameraTiming& timing = made.cameras[i];
    made.head_from_camera.push_back(input.cameras[i].role == CameraRole::head
                                        ? shift * found.heads[i]
                                        : input.cameras[i].head_from_camera);
    timing.offset_s = found.offset_s[i];
    timing.offset_sigma_s = sigma(problem.layout().offset[i]);
    timing.row_s = found.row_s[i];
    timing.row_sigma_s = sigma(problem.layout().row[i]);
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
  const bool good = made.rms_px <= options.good_rms_px, usable = made.rms_px <= options.usable_rms_px;
  made.result.verdict = good ? Verdict::good : usable ? Verdict::usable : Verdict::bad;
  made.result.words = fmt::format("{:.2f} px over {} corners in {:.1f} s; corners moved at {:.0f} px/s.{}",
                                  made.rms_px, problem.corners().size(), end_s - begin_s, made.speed_px_s,
                                  good ? "" : " Is the rig stiff, and are the tags flat?");
  return made;
}

}  // namespace handloft::tracking
