#include "daemon-tracking/calibrate/seen_tags.h"

#include <algorithm>

namespace handloft::tracking {
namespace {

/// Standing tags are looked at more often than the daemon does: here they are what is measured.
constexpr int look_at_standing_every = 3;

}  // namespace

Result<SeenTags> SeenTags::create(const Rig& rig) {
  SeenTags made;
  for (const CameraCalibration& camera : rig.cameras) {
    TagTrackerOptions options;
    for (const TagPlacement& tag : rig.table_tags) options.known_ids.push_back(tag.id);
    if (camera.role == CameraRole::table) {
      options.standing_ids = options.known_ids;
      for (const TagPlacement& tag : rig.head_tags) options.known_ids.push_back(tag.id);
    }
    options.standing_every = look_at_standing_every;
    auto tracker = TagTracker::create(options);
    if (!tracker) return tracker.error();
    made.trackers_.push_back(std::move(*tracker));
  }
  return made;
}

const TagSight& SeenTags::look(const CameraFrame& frame, const Plane& luma) {
  sights_.push_back({frame.camera, frame.capture_time, {}});
  if (frame.camera < trackers_.size())
    sights_.back().tags = trackers_[frame.camera].track(luma, frame.capture_time).tags;
  return sights_.back();
}

BoardView table_view(const Rig& rig, const TagSight& sight, std::string source) {
  BoardView view;
  view.camera = sight.camera;
  view.time = sight.time;
  view.source = std::move(source);
  for (const TagDetection& tag : sight.tags) {
    const auto placed = std::find_if(rig.table_tags.begin(), rig.table_tags.end(),
                                     [&](const TagPlacement& placement) { return placement.id == tag.id; });
    if (placed == rig.table_tags.end()) continue;
    const auto points = tag_corners(*placed);
    for (std::size_t i = 0; i < points.size(); ++i) {
      view.ids.push_back(tag.id * 4 + static_cast<int>(i));
      view.corners.push_back({points[i], tag.corners_px[i]});
    }
  }
  return view;
}

}  // namespace handloft::tracking
