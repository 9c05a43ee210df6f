#pragma once
// The frame loop's watch: waits where the pacer says (and nowhere else, V5), measures what it needs to know,
// and keeps the figures of how old what is seen is (V1).

#include <optional>

#include "client-hmd/mirror/photon_figures.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/view/frame_pacer.h"
#include "client-hmd/view/tracking_feed.h"

namespace handloft::client {

class FrameTiming {
 public:
  /// `unpaced_latency`: from drawing to light where nothing tells of refreshes. `clock` must outlive this.
  FrameTiming(const Clock& clock, Duration unpaced_latency);

  /// Before input is read: waits until the frame is to begin, at most a refresh. `period`: of the display;
  /// none: no waiting.
  const FramePlan& begin(std::optional<Duration> period);
  /// After the scene was sent to the card: waits until the head is to be asked for.
  void drawn();
  /// After the swap. `tracking`: null when nobody tracks.
  void shown(const Frame& frame, const TrackingFeed* tracking);
  /// Nothing of the window can be seen: a pause instead of a frame.
  void skipped();

  const PhotonFigures& figures() const { return figures_; }

 private:
  void wait_until(TimePoint time) const;

  const Clock& clock_;
  FramePacer pacer_;
  FramePlan plan_;
  std::optional<Duration> period_;
  TimePoint drawn_from_;
  TimePoint latched_at_;
  Duration scene_{};
  PhotonFigures figures_;
};

/// Lines of the figures in the picture's lower left corner, small.
void add_stats(const std::string& lines, int height_px, Overlay& overlay);

}  // namespace handloft::client
