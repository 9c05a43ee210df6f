#pragma once
// All tags of the rig in all frames of a step, found as the daemon finds them.

#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/calibration/board.h"
#include "daemon-tracking/calibration/trajectory.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/tag_tracker.h"

namespace handloft::tracking {

class SeenTags {
 public:
  /// Errors: as TagTracker::create.
  static Result<SeenTags> create(const Rig& rig);

  /// Looks at a frame; its sight is kept, also when it is empty. Valid until the next call.
  const TagSight& look(const CameraFrame& frame, const Plane& luma);
  const std::vector<TagSight>& sights() const { return sights_; }

 private:
  std::vector<TagTracker> trackers_;  ///< One per camera.
  std::vector<TagSight> sights_;
};

/// What of the sight belongs to the table, as a view of its board.
BoardView table_view(const Rig& rig, const TagSight& sight, std::string source);

}  // namespace handloft::tracking
