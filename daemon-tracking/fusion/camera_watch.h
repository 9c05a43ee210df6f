#pragma once
// Whether a table camera still stands where it was calibrated (T12): it sees the table's own tags every now
// and then (TagTrackerOptions::standing_every), and their corners must lie where the calibration says. A
// camera that was pushed shows all of them elsewhere; a tag that is partly covered only some, so the median
// is judged.

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking {

struct CameraWatchOptions {
  double moved_px = 1.0;  ///< T12: the table residual from which a camera moved,
  Duration moved_for = std::chrono::milliseconds(1000);  ///< and for how long.
};

struct CameraPlacement {
  std::string name;
  double residual_px = 0.0;  ///< Median distance of the table's corners from where they should be
  int corners = 0;           ///< That it rests on; 0: no table tag was seen yet
  bool moved = false;
};

/// In words for people, empty when all is well.
std::string placement_problem(const CameraPlacement& placement);

class CameraWatch {
 public:
  /// Fails with the error of the first camera that has no valid model.
  static Result<CameraWatch> create(const Rig& rig, const CameraWatchOptions& options = {});

  /// Frames without table tags, of head cameras or of cameras that the rig lacks change nothing.
  void update(const CameraObservation& observation);

  /// One per camera of the rig; head cameras are never judged.
  const std::vector<CameraPlacement>& placements() const { return placements_; }

 private:
  struct Camera {
    std::map<int, std::array<Eigen::Vector2d, 4>> expected_px;  ///< By tag
    std::optional<TimePoint> off_since;
  };
  CameraWatchOptions options_;
  std::vector<Camera> cameras_;
  std::vector<CameraPlacement> placements_;
};

}  // namespace handloft::tracking
