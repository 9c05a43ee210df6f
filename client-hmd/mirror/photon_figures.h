#pragma once
// How old what is seen is, frame for frame (V1): from the film's exposure and from the newest measurement of
// head or hand that was used, to light. Light is estimated: when the swap returned, and half a refresh for
// the way down to the middle line; a display's own delay comes on top.

#include <optional>
#include <string>

#include "client-hmd/mirror/latency.h"

namespace handloft::client {

struct FrameTimes {
  std::optional<TimePoint> exposure;     ///< Of the film that is shown; none: no film.
  std::optional<TimePoint> newest_pose;  ///< Measurement that the last turn came from; none: nobody tracks.
  TimePoint predicted_light;             ///< For when everything was drawn.
  TimePoint swapped;                     ///< The swap returned.
  Duration to_light{};                   ///< From there; half a refresh, or zero when nothing refreshes.
  bool missed_refresh = false;
};

struct PhotonFigures {
  LatencyHistogram camera_to_photon;
  LatencyHistogram motion_to_photon;
  LatencyHistogram prediction_error;  ///< Of the time of light, whichever way.
  std::uint64_t frames = 0;
  std::uint64_t missed_refreshes = 0;
  std::uint64_t repeated_films = 0;  ///< Frames that showed the same picture as the one before.
  std::uint64_t skipped = 0;         ///< Not drawn, because nothing could be seen.
  std::optional<TimePoint> last_exposure;

  void add(const FrameTimes& times);
};

/// "camera to light 41 ms (p95 52, p99 60)", a line each; what was never measured is left out.
std::string describe(const PhotonFigures& figures, const LatencyHistogram& frame_time);

}  // namespace handloft::client
