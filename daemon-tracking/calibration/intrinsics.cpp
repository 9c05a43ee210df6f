#include "daemon-tracking/calibration/intrinsics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>

namespace handloft::tracking {
namespace {

/// A webcam's focal length in widths of its picture, when nothing better is known: 55 degrees across.
constexpr double usual_focal_widths = 0.95;
constexpr double degrees = 180.0 / std::numbers::pi;

Error refused(std::string words) {
  return make_error(ErrorCode::failed_precondition, std::move(words), "intrinsics");
}

double distance_px(const BoardView& a, const BoardView& b) {
  double sum = 0;
  int same = 0;
  for (std::size_t i = 0; i < a.ids.size(); ++i) {
    const auto at = std::find(b.ids.begin(), b.ids.end(), a.ids[i]);
    if (at == b.ids.end()) continue;
    sum += (a.corners[i].pixel - b.corners[static_cast<std::size_t>(at - b.ids.begin())].pixel).norm();
    ++same;
  }
  // Boards that share no corner are as different as can be.
  return same > 0 ? sum / same : std::numeric_limits<double>::max();
}

/// The most different of the usable views: each next one is the farthest from those chosen.
std::vector<std::size_t> choose(const std::vector<BoardView>& views, const std::vector<std::size_t>& usable,
                                const IntrinsicsOptions& options) {
  if (usable.empty()) return {};
  std::vector<double> nearest(usable.size(), std::numeric_limits<double>::max());
  std::vector<std::size_t> chosen;
  std::size_t next = 0;
  while (chosen.size() < options.max_views) {
    chosen.push_back(usable[next]);
    for (std::size_t i = 0; i < usable.size(); ++i)
      nearest[i] = std::min(nearest[i], distance_px(views[usable[i]], views[usable[next]]));
    const auto farthest = std::max_element(nearest.begin(), nearest.end());
    if (*farthest <= 0.0 || *farthest < options.min_different_px) break;
    next = static_cast<std::size_t>(farthest - nearest.begin());
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

CameraIntrinsics first_guess(const std::vector<BoardView>& views, const std::vector<std::size_t>& chosen,
                             int width_px, int height_px) {
  CameraIntrinsics lens;
  lens.width_px = width_px;
  lens.height_px = height_px;
  lens.cx_px = 0.5 * (width_px - 1);
  lens.cy_px = 0.5 * (height_px - 1);
  lens.fx_px = lens.fy_px = usual_focal_widths * width_px;
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const std::size_t view : chosen) {
    auto& of_points = points.emplace_back();
    auto& of_pixels = pixels.emplace_back();
    for (const CornerMeasurement& corner : views[view].corners) {
      const Eigen::Vector3f point = corner.point_m.cast<float>();
      const Eigen::Vector2f pixel = corner.pixel.cast<float>();
      of_points.emplace_back(point.x(), point.y(), 0.0F);
      of_pixels.emplace_back(pixel.x(), pixel.y());
    }
  }
  try {
    const cv::Mat guess = cv::initCameraMatrix2D(points, pixels, {width_px, height_px}, 1.0);
    const double focal = guess.at<double>(0, 0);
    // Beyond a fish-eye or a telescope: the closed form failed, as it does when all views are alike.
    if (std::isfinite(focal) && focal > 0.2 * width_px && focal < 10.0 * width_px)
      lens.fx_px = lens.fy_px = focal;
  } catch (const cv::Exception&) {
    return lens;
  }
  return lens;
}

struct Fit {
  BundleProblem problem;
  BundleOutcome outcome;
  std::vector<double> view_rms_px;
};

/// Lens and poses from the chosen views.
Result<Fit> fit(const std::vector<BoardView>& views, const std::vector<std::size_t>& chosen,
                const CameraIntrinsics& start, const IntrinsicsOptions& options) {
  Fit made;
  BundleLens lens{start, {}};
  lens.hold.fill(Hold::free);
  made.problem.lenses.push_back(lens);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const auto pose = pose_of_view(start, views[chosen[i]]);
    if (!pose)
      return refused(fmt::format("the board in {} has no pose: leave it out", views[chosen[i]].source));
    made.problem.poses.push_back({*pose, Hold::free});
    for (const CornerMeasurement& corner : views[chosen[i]].corners) {
      BundleCorner& seen = made.problem.corners.emplace_back();
      seen.chain[0] = {static_cast<std::uint32_t>(i), BundleLink::Way::forward};
      seen.links = 1;
      seen.point_m = corner.point_m;
      seen.pixel = corner.pixel;
    }
  }
  // Distortion joins once the rest is near: far off, it would explain what poses should.
  for (std::size_t term = 4; term < lens_unknowns; ++term) made.problem.lenses[0].hold[term] = Hold::fixed;
  BundleOptions bundle;
  bundle.huber_sigmas = std::numeric_limits<double>::infinity();
  Result<BundleOutcome> outcome = adjust(made.problem, bundle);
  if (!outcome) return outcome.error();
  made.problem.lenses[0].hold.fill(Hold::free);
  outcome = adjust(made.problem, bundle);
  if (!outcome) return outcome.error();
  // Then what lies far out is weighted down, measured by what most corners do.
  const double sigma = robust_sigma(outcome->residuals);
  const bool outliers =
      std::any_of(outcome->residuals.begin(), outcome->residuals.end(),
                  [&](const auto& residual) { return residual.norm() > options.huber_sigmas * 1.5 * sigma; });
  if (outliers && sigma > 0) {
    bundle.huber_sigmas = options.huber_sigmas * 1.5 * sigma;  // Corners' sigma is 1 px here.
    outcome = adjust(made.problem, bundle);
    if (!outcome) return outcome.error();
  }
  made.outcome = std::move(*outcome);
  std::size_t corner = 0;
  for (const std::size_t view : chosen) {
    double sum = 0;
    for (std::size_t i = 0; i < views[view].corners.size(); ++i, ++corner)
      sum += made.outcome.residuals[corner].squaredNorm();
    made.view_rms_px.push_back(std::sqrt(sum / static_cast<double>(views[view].corners.size())));
  }
  return made;
}

double largest_tilt_deg(const std::vector<BundlePose>& poses) {
  double least_cosine = 1.0;
  for (const BundlePose& a : poses)
    for (const BundlePose& b : poses)
      least_cosine = std::min(least_cosine, a.value.linear().col(2).dot(b.value.linear().col(2)));
  return degrees * std::acos(std::clamp(least_cosine, -1.0, 1.0));
}

void judge(IntrinsicsCalibration& made, const IntrinsicsOptions& options) {
  const double focal_share = made.sigmas[0] / made.lens.fx_px;
  const auto within = [&](double rms_px, double coverage, double focal_sigma) {
    return made.rms_px <= rms_px && made.coverage >= coverage && focal_share <= focal_sigma;
  };
  StepResult& result = made.result;
  result.residual = made.rms_px;
  result.unit = "px";
  if (within(options.good_rms_px, options.good_coverage, options.good_focal_sigma)) {
    result.verdict = Verdict::good;
  } else if (within(options.usable_rms_px, options.usable_coverage, options.usable_focal_sigma)) {
    result.verdict = Verdict::usable;
  } else {
    result.verdict = Verdict::bad;
  }
  std::string advice;
  if (result.verdict != Verdict::good) {
    if (made.rms_px > options.good_rms_px)
      advice += " Corners fit badly: is the board flat, and is it the right one?";
    if (made.coverage < options.good_coverage)
      advice += " Hold the board into the picture's corners and edges, too.";
    if (focal_share > options.good_focal_sigma) advice += " Take more views, tilted more and from nearer.";
  }
  result.words = fmt::format(
      "{:.2f} px over {} views, {:.0f} % of the picture covered, focal length {:.1f} +- {:.1f} px.{}",
      made.rms_px, made.used.size(), 100 * made.coverage, made.lens.fx_px, made.sigmas[0], advice);
}

}  // namespace

std::string refusal_of(const BoardView& view, std::size_t min_corners, double max_motion_px,
                       double max_edge_width_px) {
  if (view.corners.size() < min_corners)
    return fmt::format("only {} corners seen, expected {}", view.corners.size(), min_corners);
  if (view.motion_px && *view.motion_px > max_motion_px)
    return fmt::format(
        "it moved by {:.1f} px since the picture before, expected at most {:.1f}: hold it still",
        *view.motion_px, max_motion_px);
  if (view.edge_width_px && *view.edge_width_px > max_edge_width_px)
    return fmt::format("blurred: edges are {:.1f} px wide, expected at most {:.1f}: hold it still, or focus",
                       *view.edge_width_px, max_edge_width_px);
  return {};
}

Result<IntrinsicsCalibration> calibrate_intrinsics(const std::vector<BoardView>& views, int width_px,
                                                   int height_px, const IntrinsicsOptions& options) {
  if (width_px < 1 || height_px < 1)
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} x {}, expected a picture's size", width_px, height_px),
                      "intrinsics");
  IntrinsicsCalibration made;
  std::vector<std::size_t> usable;
  std::string last_reason;
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::string reason =
        refusal_of(views[i], options.min_corners, options.max_motion_px, options.max_edge_width_px);
    if (reason.empty()) {
      usable.push_back(i);
    } else {
      last_reason = fmt::format("{}: {}", views[i].source, reason);
      made.views.push_back({i, 0.0, std::move(reason)});
    }
  }
  std::vector<std::size_t> chosen = choose(views, usable, options);
  const auto too_few = [&](std::size_t count) {
    return refused(
        fmt::format("found {} usable and different views of the board among {}, expected at least {}{}{}: "
                    "hold the board still in "
                    "more places and at other angles",
                    count, views.size(), options.min_views,
                    last_reason.empty() ? "" : "; refused, for instance, ", last_reason));
  };
  if (chosen.size() < options.min_views) return too_few(chosen.size());

  const CameraIntrinsics start = first_guess(views, chosen, width_px, height_px);
  Result<Fit> fitted = fit(views, chosen, start, options);
  if (!fitted) return fitted.error();
  // A few views that are worse than all others (a bent board, a wrong corner) are left out, one at a time.
  while (true) {
    std::vector<double> sorted = fitted->view_rms_px;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                     sorted.end());
    const double limit =
        std::max(options.refuse_view_rms_px, options.refuse_view_rms * sorted[sorted.size() / 2]);
    const auto worst = std::max_element(fitted->view_rms_px.begin(), fitted->view_rms_px.end());
    if (*worst <= limit) break;
    const auto at = worst - fitted->view_rms_px.begin();
    last_reason =
        fmt::format("it fits to {:.2f} px, the others to {:.2f}", *worst, sorted[sorted.size() / 2]);
    made.views.push_back({chosen[static_cast<std::size_t>(at)], *worst, last_reason});
    chosen.erase(chosen.begin() + at);
    if (chosen.size() < options.min_views) return too_few(chosen.size());
    fitted = fit(views, chosen, fitted->problem.lenses[0].value, options);
    if (!fitted) return fitted.error();
  }

  made.lens = fitted->problem.lenses[0].value;
  made.rms_px = fitted->outcome.rms_px;
  made.tilt_deg = largest_tilt_deg(fitted->problem.poses);
  if (made.tilt_deg < options.min_tilt_deg)
    return refused(
        fmt::format("all {} views are from one angle (within {:.0f} degrees), expected at least {:.0f}: tilt "
                    "the board to the left, right, up and down",
                    chosen.size(), made.tilt_deg, options.min_tilt_deg));
  if (fitted->outcome.lens_sigmas.empty())
    return refused(
        "the views don't determine the lens: tilt the board more, and bring it to the picture's edges");
  made.sigmas = fitted->outcome.lens_sigmas[0];
  made.used = chosen;
  std::size_t corner = 0;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    made.poses.push_back(fitted->problem.poses[i].value);
    auto& residuals = made.residuals.emplace_back();
    for (const CornerMeasurement& seen : views[chosen[i]].corners) {
      residuals.push_back(fitted->outcome.residuals[corner++]);
      const int column =
          std::clamp(static_cast<int>(seen.pixel.x() * coverage_columns / width_px), 0, coverage_columns - 1);
      const int row =
          std::clamp(static_cast<int>(seen.pixel.y() * coverage_rows / height_px), 0, coverage_rows - 1);
      ++made.field_corners[coverage_field(column, row)];
    }
    made.views.push_back({chosen[i], fitted->view_rms_px[i], {}});
  }
  const auto covered =
      std::count_if(made.field_corners.begin(), made.field_corners.end(), [](int n) { return n > 0; });
  made.coverage = static_cast<double>(covered) / static_cast<double>(made.field_corners.size());
  std::sort(made.views.begin(), made.views.end(),
            [](const auto& a, const auto& b) { return a.view < b.view; });
  judge(made, options);
  return made;
}

}  // namespace handloft::tracking
