#pragma once
// Whether a calibration still holds (T11, T12): what the cameras see now against what the file says. Per
// camera the table's tags and the head's; between cameras, where both put the same corner. Pure.

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/calibration/trajectory.h"
#include "daemon-tracking/source/calibration_file.h"

namespace handloft::tracking {

struct CheckOptions {
  double good_table_px = 0.6, usable_table_px = 1.5;  ///< T12 warns above 1 px.
  double good_head_px = 0.8, usable_head_px = 2.0;
  double good_point_m = 0.001, usable_point_m = 0.003;
  std::size_t least_seen = 3;  ///< A standing corner counts when it was seen as often.
};

struct CameraCheck {
  std::string name;
  std::optional<double> table_px;  ///< RMS of the table's tags; nullopt: none seen.
  std::optional<double> head_px;   ///< RMS of the head's tags about each frame's own best pose.
  std::size_t table_corners = 0, head_frames = 0;
  StepResult result;
};

struct CalibrationCheck {
  std::vector<CameraCheck> cameras;
  /// Corners of the table's tags, triangulated from two cameras or more: RMS distance from their places.
  std::optional<double> point_m;
  std::size_t points = 0;
  StepResult result;  ///< Of all.
};

/// `sights` may hold tags of table and head together. Errors: those of the cameras' values;
/// failed_precondition when nothing was seen at all.
Result<CalibrationCheck> check_sights(const Calibration& calibration, const std::vector<TagSight>& sights,
                                      const CheckOptions& options = {});

}  // namespace handloft::tracking
