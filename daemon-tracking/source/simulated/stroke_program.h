#pragma once
// Lets the simulated hand follow real recorded strokes with their pressure and timing, scaled to the table.

#include <Eigen/Core>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/simulated/hand_program.h"

namespace handloft::tracking {

struct StrokePoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double pressure = 1.0;  ///< 0..1
  double time_s = 0.0;    ///< Not decreasing within a stroke; where strokes begin doesn't matter.
};
using Stroke = std::vector<StrokePoint>;

struct StrokeProgramOptions {
  HandOptions hand;
  double box_m = 0.16;                       ///< The longest edge of the strokes' box after scaling.
  Eigen::Vector3d centre_m{0.0, 0.0, 0.14};  ///< Of that box: its bottom stays above the table.
  double shortest_stroke_s = 0.1;            ///< A dab is held at least so long.
  /// Strokes are slowed down when the 99th percentile of their speed is above this: about the fastest of real
  /// hands, and what cameras at 30 frames a second follow (tracking.md 3.4).
  double fastest_m_s = 0.5;
  std::size_t max_points = 1'000'000;
};

/// What was done to the strokes: world = scale * (stroke - from_centre) + centre, times stretched.
struct StrokePlacement {
  double scale = 1.0;
  Eigen::Vector3d from_centre_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double time_stretch = 1.0;  ///< 1 when the real timing was kept.
  double speed_p99_m_s = 0;   ///< After scaling, before stretching.

  Eigen::Vector3d place(const Eigen::Vector3d& stroke_position_m) const {
    return scale * (stroke_position_m - from_centre_m) + centre_m;
  }
};

struct StrokeProgram {
  HandProgram program;
  StrokePlacement placement;
};

/// All strokes one after the other with moves at zero pressure between them, then "Fit". Errors:
/// invalid_argument (no points, NaN or infinite values, pressure outside 0..1, time that runs back),
/// resource_exhausted (too many points).
Result<StrokeProgram> stroke_program(const std::vector<Stroke>& strokes,
                                     const StrokeProgramOptions& options = {});

}  // namespace handloft::tracking
