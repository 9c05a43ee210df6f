#include "daemon-tracking/vision/camera_tracker.h"

#include <fmt/core.h>

#include <utility>

namespace handloft::tracking {

CameraTracker::CameraTracker(const CameraCalibration& calibration, std::uint32_t camera, TagTracker tags,
                             FingertipTracker fingertips, const Clock* stopwatch)
    : calibration_(calibration),
      camera_(camera),
      tags_(std::move(tags)),
      fingertips_(std::move(fingertips)),
      stopwatch_(stopwatch) {}

Result<CameraTracker> CameraTracker::create(const Rig& rig, std::uint32_t camera,
                                            const CameraTrackerOptions& options) {
  if (camera >= rig.cameras.size())
    return make_error(ErrorCode::not_found,
                      fmt::format("found camera {}, but the rig has {}", camera, rig.cameras.size()),
                      "camera");
  const CameraCalibration& calibration = rig.cameras[camera];
  TagTrackerOptions tag_options = options.tags;
  tag_options.whole_frame_search = WholeFrameSearch::later;
  tag_options.known_ids.clear();
  // A head camera never sees its own head's tags.
  if (calibration.role == CameraRole::table)
    for (const TagPlacement& tag : rig.head_tags) tag_options.known_ids.push_back(tag.id);
  tag_options.standing_ids.clear();
  for (const TagPlacement& tag : rig.table_tags) {
    tag_options.known_ids.push_back(tag.id);
    if (calibration.role == CameraRole::table) tag_options.standing_ids.push_back(tag.id);
  }
  auto tags = TagTracker::create(tag_options);
  if (!tags) return tags.error();
  auto fingertips = FingertipTracker::create(rig.colours, options.fingertips);
  if (!fingertips) return fingertips.error();
  return CameraTracker(calibration, camera, std::move(*tags), std::move(*fingertips), options.stopwatch);
}

void CameraTracker::finish_search() {
  if (tags_.search_due()) tags_.search(decoder_.picture().y, last_time_);
}

Result<CameraObservation> CameraTracker::process(const CameraFrame& frame) {
  const auto refuse = [](std::string message, const char* field) {
    return make_error(ErrorCode::invalid_argument, std::move(message), field);
  };
  if (frame.camera != camera_)
    return refuse(fmt::format("found a frame of camera {}, expected {}", frame.camera, camera_),
                  "frame.camera");
  if (frame.width_px != calibration_.intrinsics.width_px ||
      frame.height_px != calibration_.intrinsics.height_px)
    return refuse(
        fmt::format("found {} x {}, but '{}' is calibrated for {} x {}", frame.width_px, frame.height_px,
                    calibration_.name, calibration_.intrinsics.width_px, calibration_.intrinsics.height_px),
        "frame.size");
  if (started_ && frame.capture_time <= last_time_)
    return refuse(fmt::format("found {} ns, expected more than the frame before ({} ns)",
                              to_ns(frame.capture_time), to_ns(last_time_)),
                  "frame.capture_time");
  const auto now = [this] { return stopwatch_ != nullptr ? stopwatch_->now() : TimePoint{}; };

  finish_search();  // Before its picture is overwritten.
  CameraObservation observation;
  observation.camera = camera_;
  observation.sequence = frame.sequence;
  observation.capture_time = frame.capture_time;  // The source has added the camera's offset
  observation.arrival_time = frame.arrival_time;
  const TimePoint begin = now();
  // The head's own camera steers no fingertip (its pose is far less certain than a table camera's).
  const bool colour = calibration_.role == CameraRole::table;
  auto image = decoder_.decode(frame, colour ? DecodePlanes::luma_and_chroma : DecodePlanes::luma);
  if (!image) return image.error();
  started_ = true;
  last_time_ = frame.capture_time;
  const TimePoint decoded = now();
  TagTracker::Found found = tags_.track((*image)->y, observation.capture_time);
  observation.tags = std::move(found.tags);
  observation.searched_whole_frame = found.searched_whole_frame;
  const TimePoint tagged = now();
  if (colour) observation.blobs = fingertips_.track(**image, observation.capture_time);
  const TimePoint end = now();
  observation.timings = {to_seconds(decoded - begin), to_seconds(tagged - decoded), to_seconds(end - tagged)};
  return observation;
}

}  // namespace handloft::tracking
