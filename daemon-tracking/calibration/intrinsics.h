#pragma once
// A camera's lens from many views of a flat board (T11; Zhang 2000, refined by our own bundle adjustment). A
// view that moved, is blurred or fits badly is refused, each with its reason; so is the whole when there are
// too few views, all from one angle, or the picture's edges were never covered. Pure; deterministic.

#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/calibration/board.h"
#include "daemon-tracking/calibration/bundle.h"
#include "daemon-tracking/source/calibration_file.h"

namespace handloft::tracking {

struct IntrinsicsOptions {
  std::size_t min_views = 6;        ///< Fewer leave the distortion to chance.
  std::size_t max_views = 40;       ///< The most different ones are kept: more tell little and cost time.
  std::size_t min_corners = 12;     ///< Of a view.
  double max_motion_px = 0.5;       ///< Since the frame before: a rolling shutter bends what moves.
  double max_edge_width_px = 4.5;   ///< OpenCV's advice for calibration is 3; 4.5 is visibly blurred.
  double refuse_view_rms = 3.0;     ///< Times the median view's RMS,
  double refuse_view_rms_px = 0.5;  ///< and above this.
  double min_tilt_deg = 20.0;       ///< Between the most different views.
  double min_different_px = 12.0;   ///< Mean distance of corners that makes another view of it.
  double huber_sigmas = 4.0;        ///< In robust standard deviations of the corners.
  double good_rms_px = 0.5, usable_rms_px = 1.0;
  double good_coverage = 0.6, usable_coverage = 0.35;          ///< Share of the 8 x 6 fields with a corner.
  double good_focal_sigma = 0.003, usable_focal_sigma = 0.01;  ///< Of the focal length.
};

inline constexpr int coverage_columns = 8, coverage_rows = 6;

/// Of IntrinsicsCalibration::field_corners.
constexpr std::size_t coverage_field(int column, int row) {
  return corner_index(coverage_columns, column, row);
}

struct ViewReport {
  std::size_t view = 0;  ///< Index into the views given.
  double rms_px = 0.0;   ///< 0 when it was refused before the fit.
  std::string refused;   ///< The reason; empty when it was used.
};

struct IntrinsicsCalibration {
  CameraIntrinsics lens;
  LensVector sigmas = LensVector::Zero();  ///< Standard deviations of fx, fy, cx, cy, k1, k2, p1, p2, k3.
  double rms_px = 0.0;                     ///< Over the corners of the views that were used.
  double coverage = 0.0;                   ///< 0..1
  std::array<int, static_cast<std::size_t>(coverage_columns* coverage_rows)> field_corners{};
  double tilt_deg = 0.0;
  std::vector<ViewReport> views;
  /// camera_from_board and residuals of the used views, in the order of `used`.
  std::vector<std::size_t> used;
  std::vector<Eigen::Isometry3d> poses;
  std::vector<std::vector<Eigen::Vector2d>> residuals;
  StepResult result;  ///< Without its date.
};

/// Errors: failed_precondition with the reason and what to do, when the data can't give a lens;
/// invalid_argument for a size that is not positive. All views must be of one camera.
Result<IntrinsicsCalibration> calibrate_intrinsics(const std::vector<BoardView>& views, int width_px,
                                                   int height_px, const IntrinsicsOptions& options = {});

/// Why a view is no good for calibration, in words; empty for a good one. Shared by all steps.
std::string refusal_of(const BoardView& view, std::size_t min_corners, double max_motion_px,
                       double max_edge_width_px);

}  // namespace handloft::tracking
