#pragma once
// AprilTag 36h11 tracking in one camera's luma (T5; E. Olson, ICRA 2011; Wang and Olson, IROS 2016). While
// tags are tracked, only regions around where this camera's own past detections say they are going are
// searched, at full resolution: cropping, not decimation, is what makes it cheap. The whole frame is searched
// (at half resolution, its finds refined) when nothing is tracked and every so many frames; the latter may
// wait until the frame's observation is on its way (T15). One detector per camera and one thread per
// detector: the library's own workers race (AprilRobotics/apriltag#387).

#include <memory>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/vision/image_decode.h"
#include "daemon-tracking/vision/observation.h"

namespace handloft::tracking {

/// When the whole frame is searched for tags that came into view while others are tracked.
enum class WholeFrameSearch {
  at_once,  ///< In track(): its finds are among the frame's tags.
  later,    ///< In search(), whose finds are regions of the next frame: no frame waits for it.
};

struct TagTrackerOptions {
  std::vector<int> known_ids;         ///< Others are ignored; at most 64.
  double min_decision_margin = 30.0;  ///< PhotonVision's advice: 30 to 35.
  int max_hamming = 1;                ///< 36h11 corrects more, at the price of false tags.
  double min_edge_px = 20.0;          ///< Below, corners are worth little and bits are a handful of pixels.
  double border_px = 3.0;             ///< A tag this near the border may have a cut corner.
  int whole_frame_every = 15;  ///< Frames between two searches for tags that came into view: half a second.
  int whole_frame_when_none_every = 2;  ///< The same while no tag is seen at all; always at once.
  WholeFrameSearch whole_frame_search = WholeFrameSearch::at_once;
  /// Tags that stand still before this camera (the table's, before a table camera): they only tell whether it
  /// was moved (T12) and are looked at every so many frames.
  std::vector<int> standing_ids;
  int standing_every = 10;
  double search_decimation = 2.0;  ///< Of the whole-frame search only; larger loses half of all tags.
  double roi_growth =
      0.12;  ///< Region: the tag's predicted box grown by this share of its size on each side,
  double fresh_margin_px = 20.0;  ///< plus this while a tag was seen once only and may move in any direction,
  double roi_margin_px = 6.0;     ///< plus this, plus half the motion since the last detection.
};

class TagTracker {
 public:
  /// Fails with invalid_argument for more than 64 known ids or options out of range.
  static Result<TagTracker> create(const TagTrackerOptions& options);
  ~TagTracker();
  TagTracker(TagTracker&&) noexcept;
  TagTracker& operator=(TagTracker&&) noexcept;

  struct Found {
    std::vector<TagDetection> tags;  ///< Sorted by id; each id once (the one with the larger margin).
    bool searched_whole_frame = false;
  };
  /// Deterministic in the sequence of calls. Pictures smaller than 16 pixels on a side give no tags.
  Found track(const Plane& luma, TimePoint capture_time);

  /// Whether search() is due for the picture that track() was given last; only with WholeFrameSearch::later.
  bool search_due() const;
  /// Looks for tags that came into view in that picture, so that the next call of track() looks at them
  /// closely. Without being due it does nothing.
  void search(const Plane& luma, TimePoint capture_time);

  /// Forgets all tracks: the next call searches the whole frame.
  void reset();

 private:
  struct State;
  explicit TagTracker(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace handloft::tracking
