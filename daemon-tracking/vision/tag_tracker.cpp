#include "daemon-tracking/vision/tag_tracker.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

extern "C" {
#include <apriltag.h>
#include <tag36h11.h>
}

namespace handloft::tracking {

namespace {

constexpr std::size_t max_known_ids = 64;
constexpr int smallest_side_px = 16;
// apriltag puts the centre of the top left pixel at (0.5, 0.5), we at (0, 0).
constexpr double pixel_centre = 0.5;
// Frames without a detection after which a tag is no longer expected where it was.
constexpr int frames_until_forgotten = 15;
// Steps of time beyond this say nothing about where a tag went.
constexpr double longest_step_s = 0.2;

struct Box {
  double x0, y0, x1, y1;
  void include(const Box& other) {
    x0 = std::min(x0, other.x0);
    y0 = std::min(y0, other.y0);
    x1 = std::max(x1, other.x1);
    y1 = std::max(y1, other.y1);
  }
  double area() const { return std::max(0.0, x1 - x0) * std::max(0.0, y1 - y0); }
};

struct Track {
  TimePoint time;
  Box box{};
  Eigen::Vector2d velocity_px_s{0, 0};
  bool velocity_known = false;
  int missed = 0;
};

Box box_of(const TagDetection& tag) {
  Box box{tag.corners_px[0].x(), tag.corners_px[0].y(), tag.corners_px[0].x(), tag.corners_px[0].y()};
  for (const auto& corner : tag.corners_px) box.include({corner.x(), corner.y(), corner.x(), corner.y()});
  return box;
}

struct DetectorDeleter {
  void operator()(apriltag_detector_t* detector) const { apriltag_detector_destroy(detector); }
};
struct FamilyDeleter {
  void operator()(apriltag_family_t* family) const { tag36h11_destroy(family); }
};

}  // namespace

struct TagTracker::State {
  TagTrackerOptions options;
  std::unique_ptr<apriltag_family_t, FamilyDeleter> family;  // Outlives the detector
  std::unique_ptr<apriltag_detector_t, DetectorDeleter> detector;
  std::map<int, Track> tracks;
  int frames_since_search = 0;
  int frames_since_standing = 0;
  bool searched_once = false;
  bool search_due = false;

  std::vector<TagDetection> search(const Plane& luma) {
    std::vector<TagDetection> found;
    detect(luma, {0.0, 0.0, static_cast<double>(luma.width_px), static_cast<double>(luma.height_px)},
           options.search_decimation, found);
    return found;
  }
  void detect(const Plane& luma, const Box& region, double decimation, std::vector<TagDetection>& found);
  std::vector<Box> regions(const Plane& luma, TimePoint time, bool with_standing) const;
  bool stands(int id) const {
    return std::find(options.standing_ids.begin(), options.standing_ids.end(), id) !=
           options.standing_ids.end();
  }
  void follow(const std::vector<TagDetection>& tags, TimePoint time, bool with_standing);
};

TagTracker::TagTracker(std::unique_ptr<State> state) : state_(std::move(state)) {}
TagTracker::~TagTracker() = default;
TagTracker::TagTracker(TagTracker&&) noexcept = default;
TagTracker& TagTracker::operator=(TagTracker&&) noexcept = default;

Result<TagTracker> TagTracker::create(const TagTrackerOptions& options) {
  if (options.known_ids.size() > max_known_ids)
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {} tags, expected at most {}", options.known_ids.size(), max_known_ids),
        "tags.known_ids");
  if (!(options.search_decimation >= 1.0 && options.search_decimation <= 4.0))
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1..4", options.search_decimation),
                      "tags.search_decimation");
  if (options.whole_frame_every < 1 || options.whole_frame_when_none_every < 1 || options.standing_every < 1)
    return make_error(ErrorCode::invalid_argument, "found a number of frames below 1",
                      "tags.whole_frame_every");
  auto state = std::make_unique<State>();
  state->options = options;
  state->family.reset(tag36h11_create());
  state->detector.reset(apriltag_detector_create());
  if (!state->family || !state->detector)
    return make_error(ErrorCode::internal, "libapriltag gave no detector");
  state->detector->nthreads = 1;
  state->detector->quad_sigma = 0.0f;
  state->detector->refine_edges = true;
  state->detector->decode_sharpening = 0.25;
  state->detector->debug = false;
  apriltag_detector_add_family_bits(state->detector.get(), state->family.get(), options.max_hamming);
  return TagTracker(std::move(state));
}

void TagTracker::State::detect(const Plane& luma, const Box& region, double decimation,
                               std::vector<TagDetection>& found) {
  const int x0 = std::clamp(static_cast<int>(std::floor(region.x0)), 0, luma.width_px);
  const int y0 = std::clamp(static_cast<int>(std::floor(region.y0)), 0, luma.height_px);
  const int x1 = std::clamp(static_cast<int>(std::ceil(region.x1)), 0, luma.width_px);
  const int y1 = std::clamp(static_cast<int>(std::ceil(region.y1)), 0, luma.height_px);
  if (x1 - x0 < smallest_side_px || y1 - y0 < smallest_side_px) return;
  // The library only reads the picture; its interface lacks the const.
  image_u8_t view{x1 - x0, y1 - y0, luma.width_px,
                  const_cast<std::uint8_t*>(luma.samples.data()) +
                      static_cast<std::size_t>(y0) * static_cast<std::size_t>(luma.width_px) +
                      static_cast<std::size_t>(x0)};
  detector->quad_decimate = static_cast<float>(decimation);
  zarray_t* detections = apriltag_detector_detect(detector.get(), &view);
  if (detections == nullptr) return;
  for (int i = 0; i < zarray_size(detections); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(detections, i, &detection);
    if (detection->hamming > options.max_hamming || detection->decision_margin < options.min_decision_margin)
      continue;
    if (std::find(options.known_ids.begin(), options.known_ids.end(), detection->id) ==
        options.known_ids.end())
      continue;
    TagDetection tag;
    tag.id = detection->id;
    tag.decision_margin = detection->decision_margin;
    tag.hamming = detection->hamming;
    bool usable = true;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      // The region's offset is added before anything is undistorted.
      tag.corners_px[corner] = {detection->p[corner][0] + x0 - pixel_centre,
                                detection->p[corner][1] + y0 - pixel_centre};
      const Eigen::Vector2d& at = tag.corners_px[corner];
      usable = usable && at.allFinite() && at.x() >= options.border_px && at.y() >= options.border_px &&
               at.x() <= luma.width_px - 1 - options.border_px &&
               at.y() <= luma.height_px - 1 - options.border_px;
    }
    tag.shortest_edge_px = (tag.corners_px[3] - tag.corners_px[0]).norm();
    for (std::size_t corner = 0; corner < 3; ++corner)
      tag.shortest_edge_px =
          std::min(tag.shortest_edge_px, (tag.corners_px[corner + 1] - tag.corners_px[corner]).norm());
    if (!usable || tag.shortest_edge_px < options.min_edge_px) continue;
    const auto known =
        std::find_if(found.begin(), found.end(), [&](const auto& other) { return other.id == tag.id; });
    if (known == found.end()) {
      found.push_back(tag);
    } else if (tag.decision_margin > known->decision_margin) {
      *known = tag;
    }
  }
  apriltag_detections_destroy(detections);
}

std::vector<Box> TagTracker::State::regions(const Plane& luma, TimePoint time, bool with_standing) const {
  std::vector<Box> boxes;
  for (const auto& [id, track] : tracks) {
    if (!with_standing && stands(id)) continue;
    const double step_s = std::clamp(to_seconds(time - track.time), 0.0, longest_step_s);
    const Eigen::Vector2d motion = track.velocity_px_s * step_s;
    const double size = std::max(track.box.x1 - track.box.x0, track.box.y1 - track.box.y0);
    const double grow = options.roi_growth * size + options.roi_margin_px + 0.5 * motion.norm() +
                        (track.velocity_known || stands(id) ? 0.0 : options.fresh_margin_px) +
                        static_cast<double>(track.missed) * options.roi_margin_px;
    Box box{track.box.x0 + motion.x() - grow, track.box.y0 + motion.y() - grow,
            track.box.x1 + motion.x() + grow, track.box.y1 + motion.y() + grow};
    box.x0 = std::clamp(box.x0, 0.0, static_cast<double>(luma.width_px));
    box.x1 = std::clamp(box.x1, 0.0, static_cast<double>(luma.width_px));
    box.y0 = std::clamp(box.y0, 0.0, static_cast<double>(luma.height_px));
    box.y1 = std::clamp(box.y1, 0.0, static_cast<double>(luma.height_px));
    if (box.area() > 0.0) boxes.push_back(box);
  }
  // Regions that overlap a lot are searched as one; for others the frame around both would cost more.
  for (std::size_t i = 0; i < boxes.size();) {
    bool merged = false;
    for (std::size_t j = i + 1; j < boxes.size(); ++j) {
      Box both = boxes[i];
      both.include(boxes[j]);
      if (both.area() > boxes[i].area() + boxes[j].area()) continue;
      boxes[i] = both;
      boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(j));
      merged = true;
      break;
    }
    i = merged ? 0 : i + 1;
  }
  return boxes;
}

void TagTracker::State::follow(const std::vector<TagDetection>& tags, TimePoint time, bool with_standing) {
  for (auto& [id, track] : tracks)
    if (with_standing || !stands(id)) ++track.missed;
  for (const TagDetection& tag : tags) {
    const Box box = box_of(tag);
    const auto known = tracks.find(tag.id);
    Track track;
    track.time = time;
    track.box = box;
    if (known != tracks.end()) {
      const double step_s = to_seconds(time - known->second.time);
      if (step_s > 1e-4 && step_s < longest_step_s) {
        const Box& before = known->second.box;
        track.velocity_known = true;
        track.velocity_px_s = {(box.x0 + box.x1 - before.x0 - before.x1) / (2.0 * step_s),
                               (box.y0 + box.y1 - before.y0 - before.y1) / (2.0 * step_s)};
      }
    }
    tracks[tag.id] = track;
  }
  std::erase_if(tracks, [](const auto& entry) { return entry.second.missed > frames_until_forgotten; });
}

TagTracker::Found TagTracker::track(const Plane& luma, TimePoint capture_time) {
  Found found;
  if (luma.width_px < smallest_side_px || luma.height_px < smallest_side_px) return found;
  State& state = *state_;
  state.search_due = false;
  const bool with_standing = ++state.frames_since_standing >= state.options.standing_every;
  if (with_standing) state.frames_since_standing = 0;
  for (const Box& region : state.regions(luma, capture_time, with_standing))
    state.detect(luma, region, 1.0, found.tags);

  const bool none = std::all_of(state.tracks.begin(), state.tracks.end(), [&](const auto& entry) {
    return entry.second.missed > 0 || state.stands(entry.first);
  });
  const bool any_moving = std::any_of(state.options.known_ids.begin(), state.options.known_ids.end(),
                                      [&](int id) { return !state.stands(id); });
  const int interval =
      none && any_moving ? state.options.whole_frame_when_none_every : state.options.whole_frame_every;
  if (!state.searched_once || ++state.frames_since_search >= interval) {
    state.searched_once = true;
    state.frames_since_search = 0;
    const bool later = state.options.whole_frame_search == WholeFrameSearch::later && !none;
    if (later) {
      state.search_due = true;
    } else {
      found.searched_whole_frame = true;
      // What a region showed at full resolution stands; the search only adds.
      for (const TagDetection& tag : state.search(luma))
        if (std::none_of(found.tags.begin(), found.tags.end(),
                         [&](const auto& other) { return other.id == tag.id; }))
          found.tags.push_back(tag);
    }
  }
  std::sort(found.tags.begin(), found.tags.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  state.follow(found.tags, capture_time, with_standing);
  return found;
}

bool TagTracker::search_due() const {
  return state_->search_due;
}

void TagTracker::search(const Plane& luma, TimePoint capture_time) {
  if (!state_->search_due) return;
  state_->search_due = false;
  for (const TagDetection& tag : state_->search(luma)) {
    const auto known = state_->tracks.find(tag.id);
    // One that its region showed, or that was not looked at because it stands still, is followed already.
    if (known != state_->tracks.end() && known->second.missed == 0) continue;
    state_->tracks[tag.id] = Track{capture_time, box_of(tag), {0, 0}, false, 0};
  }
}

void TagTracker::reset() {
  state_->search_due = false;
  state_->tracks.clear();
  state_->frames_since_search = 0;
  state_->frames_since_standing = 0;
  state_->searched_once = false;
}

}  // namespace handloft::tracking
