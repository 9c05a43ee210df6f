#pragma once
// Where the cameras stand (T11): bundle adjustment over what all of them saw of the table's tags and of a
// board that is held still here and there. Webcams run freely, so only what stood still says where cameras
// are; what moves says how their clocks differ (trajectory.h). The world is the table's board when it is
// seen, else the hand-held board at the first moment that two cameras share. Pure; deterministic.

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/calibration/board.h"
#include "daemon-tracking/calibration/bundle.h"
#include "daemon-tracking/calibration/intrinsics.h"
#include "daemon-tracking/source/calibration_file.h"

namespace handloft::tracking {

/// A hand-held board that stood still while these cameras saw it: indices into the views.
struct Moment {
  std::vector<std::size_t> views;
};

struct MomentOptions {
  Duration gap = std::chrono::milliseconds(50);  ///< A period and a half of 30 Hz.
  double max_motion_px = 0.5;                    ///< Since the frame before.
  double other_place_px = 10.0;  ///< Corners moved by this on average: another place, that tells more.
  std::size_t most = 60;
};

/// Views of different cameras that belong together: within `gap` of each other, and still as far as is known.
std::vector<Moment> shared_moments(const std::vector<BoardView>& views, const MomentOptions& options = {});

/// One view out of many of what stands still: each corner at the median of where it was seen. Corners seen
/// fewer than `least` times, and all of views that moved, are left out. Empty when nothing remains.
BoardView still_view(const std::vector<BoardView>& views, double max_motion_px, std::size_t least);

/// How far the table's tags may be from where they are said to be.
enum class TablePrint : std::uint8_t {
  one_sheet,  ///< Printed in one piece: exactly there.
  glued,      ///< Printed page by page and glued by hand: they are measured, beginning there.
};

struct ExtrinsicsInput {
  std::vector<std::string> names;        ///< Of the cameras, for messages.
  std::vector<CameraIntrinsics> lenses;  ///< One per camera.
  std::vector<BoardView> views;          ///< Of the hand-held board.
  std::vector<Moment> moments;           ///< Over `views`.
  std::vector<BoardView> table_views;    ///< still_view() of the table's tags, at most one per camera.
  std::vector<TagPlacement> table_tags;  ///< World from tag.
};

struct ExtrinsicsOptions {
  TablePrint print = TablePrint::glued;
  double glued_sigma_m = 0.004, glued_sigma_rad = 0.03;  ///< By hand along a pencil line.
  Hold lenses = Hold::fixed;                             ///< Free: refined together with the poses.
  double corner_sigma_px = 0.3;     ///< Against which the priors of glued tags are weighed.
  double huber_sigmas = 4.0;        ///< In robust standard deviations of the corners.
  double refuse_view_rms = 4.0;     ///< Times the median,
  double refuse_view_rms_px = 0.8;  ///< and above this.
  std::size_t min_table_tags = 3;   ///< Seen by a camera that shares no moment with another.
  double good_rms_px = 0.5, usable_rms_px = 1.2;
  double good_sigma_m = 0.001, usable_sigma_m = 0.004;  ///< Of a camera's position among the tags.
};

struct ExtrinsicsCalibration {
  std::vector<Eigen::Isometry3d> world_from_camera;
  std::vector<Eigen::Matrix<double, 6, 1>> sigmas;  ///< Translation m, rotation rad, per camera.
  std::vector<CameraIntrinsics> lenses;             ///< As given, or refined.
  std::vector<TagPlacement> table_tags;             ///< As given, or measured.
  double rms_px = 0.0;
  std::vector<double> camera_rms_px;
  std::vector<ViewReport> refused;  ///< Hand-held views that fitted badly: indices into `views`.
  std::vector<StepResult> results;  ///< Per camera, without dates.
};

/// Errors: invalid_argument for lists that don't fit together; failed_precondition, naming the camera, when
/// it shares no view with the others.
Result<ExtrinsicsCalibration> calibrate_extrinsics(const ExtrinsicsInput& input,
                                                   const ExtrinsicsOptions& options = {});

/// The rigid motion that brings `from` onto `onto` with the least squares (Umeyama 1991, without scale).
/// Precondition: as many of both, at least 3 and not on a line.
Eigen::Isometry3d best_motion(const std::vector<Eigen::Vector3d>& from,
                              const std::vector<Eigen::Vector3d>& onto);

}  // namespace handloft::tracking
