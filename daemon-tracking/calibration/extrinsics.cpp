#include "daemon-tracking/calibration/extrinsics.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

namespace handloft::tracking {
namespace {

using Eigen::Isometry3d;

/// A start may be off by some pixels: until then no corner is an outlier for less.
constexpr double first_huber_px = 3.0;

Error refused(std::string words) {
  return make_error(ErrorCode::failed_precondition, std::move(words), "extrinsics");
}

double moved_px(const BoardView& a, const BoardView& b) {
  double sum = 0;
  int same = 0;
  for (std::size_t i = 0; i < a.ids.size(); ++i) {
    const auto at = std::find(b.ids.begin(), b.ids.end(), a.ids[i]);
    if (at == b.ids.end()) continue;
    sum += (a.corners[i].pixel - b.corners[static_cast<std::size_t>(at - b.ids.begin())].pixel).norm();
    ++same;
  }
  return same > 0 ? sum / same : std::numeric_limits<double>::max();
}

/// Everything that is estimated, with where it stands in the bundle.
struct Assembly {
  const ExtrinsicsInput& input;
  const ExtrinsicsOptions& options;
  std::vector<std::optional<Isometry3d>> cameras;            ///< world_from_camera
  std::vector<std::optional<Isometry3d>> boards;             ///< world_from_board, per moment
  std::vector<std::vector<std::optional<Isometry3d>>> seen;  ///< camera_from_board, per moment and view

  bool table() const { return !input.table_views.empty(); }
};

std::optional<double> cost_of(const CameraIntrinsics& lens, const Isometry3d& camera_from_board,
                              const BoardView& view) {
  double sum = 0;
  for (const CornerMeasurement& corner : view.corners) {
    const auto pixel = project_through(lens, camera_from_board * corner.point_m);
    if (!pixel) return std::nullopt;
    // One wrong view must not decide: a corner costs no more than 20 px do.
    sum += std::min(400.0, (pixel->pixel - corner.pixel).squaredNorm());
  }
  return sum;
}

/// First poses of cameras: by the table, then from camera to camera over the moments that two share. Of the
/// poses that the moments suggest for a camera, the one that suits all of them best is taken.
Status place(Assembly& made) {
  const ExtrinsicsInput& input = made.input;
  made.cameras.resize(input.lenses.size());
  made.boards.resize(input.moments.size());
  for (const Moment& moment : input.moments) {
    auto& poses = made.seen.emplace_back();
    for (const std::size_t view : moment.views)
      poses.push_back(pose_of_view(input.lenses[input.views[view].camera], input.views[view]));
  }
  for (const BoardView& view : input.table_views) {
    if (view.corners.size() < 4 * made.options.min_table_tags) continue;
    if (const auto pose = pose_of_view(input.lenses[view.camera], view))
      made.cameras[view.camera] = pose->inverse();
  }
  const auto place_boards = [&] {
    for (std::size_t m = 0; m < input.moments.size(); ++m)
      for (std::size_t v = 0; v < input.moments[m].views.size() && !made.boards[m]; ++v) {
        const auto& camera = made.cameras[input.views[input.moments[m].views[v]].camera];
        if (camera && made.seen[m][v]) made.boards[m] = *camera * *made.seen[m][v];
      }
  };
  if (!made.table()) {
    const auto first = std::find_if(input.moments.begin(), input.moments.end(),
                                    [](const Moment& moment) { return moment.views.size() > 1; });
    if (first == input.moments.end())
      return refused("no two cameras saw the board at the same time: hold it still where two of them see it");
    const auto m = static_cast<std::size_t>(first - input.moments.begin());
    made.boards[m] = Isometry3d::Identity();
    for (std::size_t v = 0; v < first->views.size(); ++v)
      if (made.seen[m][v]) {
        made.cameras[input.views[first->views[v]].camera] = made.seen[m][v]->inverse();
        break;
      }
  }
  while (true) {
    place_boards();
    // Among the cameras that are not placed yet, the pose with the least cost over all shared moments.
    std::optional<Isometry3d> best;
    std::size_t best_camera = 0, most_shared = 0;
    double least = std::numeric_limits<double>::max();
    for (std::size_t camera = 0; camera < made.cameras.size(); ++camera) {
      if (made.cameras[camera]) continue;
      std::vector<std::pair<std::size_t, std::size_t>> shared;
      for (std::size_t m = 0; m < input.moments.size(); ++m)
        for (std::size_t v = 0; v < input.moments[m].views.size(); ++v)
          if (input.views[input.moments[m].views[v]].camera == camera && made.boards[m] && made.seen[m][v])
            shared.emplace_back(m, v);
      if (shared.empty() || shared.size() < most_shared) continue;
      if (shared.size() > most_shared) least = std::numeric_limits<double>::max();
      most_shared = shared.size();
      for (const auto& [m, v] : shared) {
        const Isometry3d trial = *made.boards[m] * made.seen[m][v]->inverse();
        double sum = 0;
        for (const auto& [other, w] : shared)
          sum += cost_of(input.lenses[camera], trial.inverse() * *made.boards[other],
                         input.views[input.moments[other].views[w]])
                     .value_or(400.0 * static_cast<double>(
                                           input.views[input.moments[other].views[w]].corners.size()));
        if (sum >= least) continue;
        least = sum;
        best = trial;
        best_camera = camera;
      }
    }
    if (!best) break;
    made.cameras[best_camera] = best;
  }
  for (std::size_t camera = 0; camera < made.cameras.size(); ++camera)
    if (!made.cameras[camera])
      return refused(
          fmt::format("camera '{}' shares no view with the others: hold the board still where it and another "
                      "camera see it, or move it to see at least {} of the table's tags",
                      input.names[camera], made.options.min_table_tags));
  return {};
}

struct Built {
  BundleProblem problem;
  std::vector<std::size_t> view_of_corner;  ///< Index into views; beyond them: table views.
  std::vector<std::uint32_t> tag_pose;      ///< Per table tag.
};

Built build(const Assembly& made, const std::vector<bool>& left_out) {
  const ExtrinsicsInput& input = made.input;
  Built built;
  BundleProblem& problem = built.problem;
  for (std::size_t camera = 0; camera < input.lenses.size(); ++camera) {
    BundleLens& lens = problem.lenses.emplace_back();
    lens.value = input.lenses[camera];
    lens.hold.fill(made.options.lenses);
    problem.poses.push_back({*made.cameras[camera], Hold::free});
  }
  bool anchored = made.table();
  std::vector<std::uint32_t> board_pose(input.moments.size(), 0);
  for (std::size_t m = 0; m < input.moments.size(); ++m) {
    if (!made.boards[m]) continue;
    board_pose[m] = static_cast<std::uint32_t>(problem.poses.size());
    const bool anchor = !anchored && made.boards[m]->isApprox(Isometry3d::Identity(), 0.0);
    problem.poses.push_back({*made.boards[m], anchor ? Hold::fixed : Hold::free});
    anchored = anchored || anchor;
    for (const std::size_t view : input.moments[m].views) {
      if (left_out[view]) continue;
      for (const CornerMeasurement& seen : input.views[view].corners) {
        BundleCorner& corner = problem.corners.emplace_back();
        corner.lens = input.views[view].camera;
        corner.chain[0] = {board_pose[m], BundleLink::Way::forward};
        corner.chain[1] = {input.views[view].camera, BundleLink::Way::inverse};
        corner.links = 2;
        corner.point_m = seen.point_m;
        corner.pixel = seen.pixel;
        corner.sigma_px = made.options.corner_sigma_px;
        built.view_of_corner.push_back(view);
      }
    }
  }
  std::map<int, std::uint32_t> pose_of_tag;
  for (const TagPlacement& tag : input.table_tags) {
    BundlePose pose{tag.body_from_tag, Hold::fixed};
    if (made.options.print == TablePrint::glued)
      pose = {tag.body_from_tag, Hold::free, made.options.glued_sigma_m, made.options.glued_sigma_rad};
    pose_of_tag[tag.id] = static_cast<std::uint32_t>(problem.poses.size());
    built.tag_pose.push_back(static_cast<std::uint32_t>(problem.poses.size()));
    problem.poses.push_back(pose);
  }
  for (std::size_t i = 0; i < input.table_views.size(); ++i) {
    const BoardView& view = input.table_views[i];
    for (std::size_t c = 0; c < view.corners.size(); ++c) {
      const int id = view.ids[c] / 4;
      const auto tag = std::find_if(input.table_tags.begin(), input.table_tags.end(),
                                    [&](const TagPlacement& placement) { return placement.id == id; });
      if (tag == input.table_tags.end()) continue;
      TagPlacement alone = *tag;
      alone.body_from_tag = Isometry3d::Identity();
      BundleCorner& corner = problem.corners.emplace_back();
      corner.lens = view.camera;
      corner.chain[0] = {pose_of_tag[id], BundleLink::Way::forward};
      corner.chain[1] = {view.camera, BundleLink::Way::inverse};
      corner.links = 2;
      corner.point_m = tag_corners(alone)[static_cast<std::size_t>(view.ids[c] % 4)];
      corner.pixel = view.corners[c].pixel;
      corner.sigma_px = made.options.corner_sigma_px;
      built.view_of_corner.push_back(input.views.size() + i);
    }
  }
  return built;
}

Result<BundleOutcome> solve(BundleProblem& problem, const ExtrinsicsOptions& options) {
  BundleOptions bundle;
  bundle.huber_sigmas = first_huber_px / options.corner_sigma_px;
  Result<BundleOutcome> outcome = adjust(problem, bundle);
  if (!outcome) return outcome;
  const double limit = options.huber_sigmas * 1.5 * robust_sigma(outcome->residuals);
  const bool outliers = std::any_of(outcome->residuals.begin(), outcome->residuals.end(),
                                    [&](const auto& residual) { return residual.norm() > limit; });
  bundle.huber_sigmas =
      outliers && limit > 0 ? limit / options.corner_sigma_px : std::numeric_limits<double>::infinity();
  return adjust(problem, bundle);
}

/// A glued board's tags carry the world with them: it is where they were said to be, on average.
void settle_world(const Assembly& made, Built& built) {
  if (!made.table() || made.options.print != TablePrint::glued) return;
  std::vector<Eigen::Vector3d> measured, nominal;
  for (std::size_t i = 0; i < made.input.table_tags.size(); ++i) {
    TagPlacement tag = made.input.table_tags[i];
    for (const Eigen::Vector3d& corner : tag_corners(tag)) nominal.push_back(corner);
    tag.body_from_tag = built.problem.poses[built.tag_pose[i]].value;
    for (const Eigen::Vector3d& corner : tag_corners(tag)) measured.push_back(corner);
  }
  const Isometry3d shift = best_motion(measured, nominal);
  for (BundlePose& pose : built.problem.poses) pose.value = shift * pose.value;
}

StepResult judge(double rms_px, const Eigen::Matrix<double, 6, 1>& sigmas, std::size_t corners,
                 const ExtrinsicsOptions& options) {
  StepResult result;
  const double sigma_m = sigmas.head<3>().norm();
  result.residual = rms_px;
  result.unit = "px";
  if (rms_px <= options.good_rms_px && sigma_m <= options.good_sigma_m) {
    result.verdict = Verdict::good;
  } else {
    result.verdict =
        rms_px <= options.usable_rms_px && sigma_m <= options.usable_sigma_m ? Verdict::usable : Verdict::bad;
  }
  std::string advice;
  if (rms_px > options.good_rms_px)
    advice += " Corners fit badly: was a tag bent, or the lens calibrated in another mode?";
  if (sigma_m > options.good_sigma_m)
    advice += " Let it see more of the table, or hold the board up in more places.";
  result.words =
      fmt::format("{:.2f} px over {} corners, position to {:.1f} mm, direction to {:.2f} degrees.{}", rms_px,
                  corners, 1e3 * sigma_m, sigmas.tail<3>().norm() * 57.2957795, advice);
  return result;
}

Status check(const ExtrinsicsInput& input) {
  const auto refuse = [](const char* field, std::string words) {
    return make_error(ErrorCode::invalid_argument, std::move(words), field);
  };
  if (input.lenses.empty() || input.names.size() != input.lenses.size())
    return refuse("lenses",
                  fmt::format("found {} lenses and {} names", input.lenses.size(), input.names.size()));
  for (const auto* views : {&input.views, &input.table_views})
    for (const BoardView& view : *views)
      if (view.camera >= input.lenses.size() || view.ids.size() != view.corners.size())
        return refuse("views", fmt::format("found a view of camera {}, expected 0 to {}", view.camera,
                                           input.lenses.size() - 1));
  for (const Moment& moment : input.moments)
    for (const std::size_t view : moment.views)
      if (view >= input.views.size())
        return refuse("moments", fmt::format("found view {}, expected fewer", view));
  return {};
}

}  // namespace

std::vector<Moment> shared_moments(const std::vector<BoardView>& views, const MomentOptions& options) {
  std::vector<std::size_t> still;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (!views[i].motion_px || *views[i].motion_px <= options.max_motion_px) still.push_back(i);
  std::stable_sort(still.begin(), still.end(),
                   [&](std::size_t a, std::size_t b) { return views[a].time < views[b].time; });
  std::vector<Moment> moments;
  for (std::size_t i = 0; i < still.size();) {
    Moment moment;
    const TimePoint begin = views[still[i]].time;
    std::size_t end = i;
    for (; end < still.size() && views[still[end]].time - begin <= options.gap; ++end) {
      const auto same = std::find_if(moment.views.begin(), moment.views.end(), [&](std::size_t view) {
        return views[view].camera == views[still[end]].camera;
      });
      if (same == moment.views.end()) moment.views.push_back(still[end]);
    }
    i = end;
    if (moment.views.size() < 2) continue;
    // The same place as a moment before tells nothing new.
    const bool known = std::any_of(moments.begin(), moments.end(), [&](const Moment& before) {
      for (const std::size_t a : moment.views)
        for (const std::size_t b : before.views)
          if (views[a].camera == views[b].camera && moved_px(views[a], views[b]) < options.other_place_px)
            return true;
      return false;
    });
    if (!known) moments.push_back(std::move(moment));
  }
  // Evenly over time, when there are too many.
  if (moments.size() > options.most && options.most > 0) {
    std::vector<Moment> fewer;
    for (std::size_t i = 0; i < options.most; ++i)
      fewer.push_back(moments[i * moments.size() / options.most]);
    moments = std::move(fewer);
  }
  return moments;
}

BoardView still_view(const std::vector<BoardView>& views, double max_motion_px, std::size_t least) {
  struct Seen {
    Eigen::Vector3d point_m;
    std::vector<double> x, y;
  };
  std::map<int, Seen> corners;
  BoardView still;
  for (const BoardView& view : views) {
    if (view.motion_px && *view.motion_px > max_motion_px) continue;
    still.camera = view.camera;
    still.time = view.time;
    still.source = view.source;
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      Seen& seen = corners[view.ids[i]];
      seen.point_m = view.corners[i].point_m;
      seen.x.push_back(view.corners[i].pixel.x());
      seen.y.push_back(view.corners[i].pixel.y());
    }
  }
  // The mean of the middle half: steadier than the median alone, and as deaf to what is far off.
  const auto middle = [](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    const std::size_t cut = values.size() / 4;
    double sum = 0;
    for (std::size_t i = cut; i < values.size() - cut; ++i) sum += values[i];
    return sum / static_cast<double>(values.size() - 2 * cut);
  };
  for (auto& [id, seen] : corners) {
    if (seen.x.size() < least) continue;
    still.ids.push_back(id);
    still.corners.push_back({seen.point_m, {middle(seen.x), middle(seen.y)}});
  }
  return still;
}

Isometry3d best_motion(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& onto) {
  Eigen::Vector3d from_mean = Eigen::Vector3d::Zero(), onto_mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : from) from_mean += point;
  for (const Eigen::Vector3d& point : onto) onto_mean += point;
  from_mean /= static_cast<double>(from.size());
  onto_mean /= static_cast<double>(onto.size());
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i)
    correlation += (onto[i] - onto_mean) * (from[i] - from_mean).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  Isometry3d motion = Isometry3d::Identity();
  motion.linear() = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  motion.translation() = onto_mean - motion.linear() * from_mean;
  return motion;
}

Result<ExtrinsicsCalibration> calibrate_extrinsics(const ExtrinsicsInput& input,
                                                   const ExtrinsicsOptions& options) {
  if (const Status good = check(input); !good) return good.error();
  Assembly assembly{input, options, {}, {}, {}};
  if (const Status placed = place(assembly); !placed) return placed.error();

  ExtrinsicsCalibration made;
  std::vector<bool> left_out(input.views.size(), false);
  Built built;
  Result<BundleOutcome> outcome = make_error(ErrorCode::internal, "nothing solved");
  while (true) {
    built = build(assembly, left_out);
    outcome = solve(built.problem, options);
    if (!outcome) return outcome.error();
    // The worst hand-held view goes, as long as it is far worse than the others.
    std::map<std::size_t, std::pair<double, int>> sums;
    for (std::size_t i = 0; i < built.view_of_corner.size(); ++i) {
      auto& [sum, count] = sums[built.view_of_corner[i]];
      sum += outcome->residuals[i].squaredNorm();
      ++count;
    }
    std::vector<double> all;
    std::size_t worst = input.views.size();
    double worst_rms = 0;
    for (const auto& [view, sum] : sums) {
      const double view_rms = std::sqrt(sum.first / sum.second);
      all.push_back(view_rms);
      if (view < input.views.size() && view_rms > worst_rms) {
        worst = view;
        worst_rms = view_rms;
      }
    }
    std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
    const double median = all[all.size() / 2];
    if (worst_rms <= std::max(options.refuse_view_rms_px, options.refuse_view_rms * median)) break;
    left_out[worst] = true;
    made.refused.push_back({worst, worst_rms,
                            fmt::format("{}: it fits to {:.2f} px, the others to {:.2f}: did the board move?",
                                        input.views[worst].source, worst_rms, median)});
  }
  if (outcome->pose_sigmas.empty())
    return refused("the views don't determine where the cameras are: hold the board up in more places");
  // Where all of the world is cannot be known; what counts is how sure a camera is among the tags as they
  // were found, so these are held for the sigmas.
  BundleProblem among = built.problem;
  for (const std::uint32_t tag : built.tag_pose) among.poses[tag].hold = Hold::fixed;
  BundleOptions only_sigmas;
  only_sigmas.max_iterations = 0;
  const Result<BundleOutcome> sure = adjust(among, only_sigmas);
  if (sure && !sure->pose_sigmas.empty()) outcome->pose_sigmas = sure->pose_sigmas;
  settle_world(assembly, built);

  made.rms_px = outcome->rms_px;
  std::vector<double> sums(input.lenses.size(), 0.0);
  std::vector<std::size_t> counts(input.lenses.size(), 0);
  for (std::size_t i = 0; i < built.problem.corners.size(); ++i) {
    sums[built.problem.corners[i].lens] += outcome->residuals[i].squaredNorm();
    ++counts[built.problem.corners[i].lens];
  }
  for (std::size_t camera = 0; camera < input.lenses.size(); ++camera) {
    made.world_from_camera.push_back(built.problem.poses[camera].value);
    made.sigmas.push_back(outcome->pose_sigmas[camera]);
    made.lenses.push_back(built.problem.lenses[camera].value);
    made.camera_rms_px.push_back(
        counts[camera] > 0 ? std::sqrt(sums[camera] / static_cast<double>(counts[camera])) : 0.0);
    made.results.push_back(judge(made.camera_rms_px.back(), made.sigmas.back(), counts[camera], options));
  }
  made.table_tags = input.table_tags;
  for (std::size_t i = 0; i < made.table_tags.size(); ++i)
    made.table_tags[i].body_from_tag = built.problem.poses[built.tag_pose[i]].value;
  return made;
}

}  // namespace handloft::tracking
