#pragma once
// Keeps a camera's CameraHealth: fed by the capture thread, read by any.

#include <mutex>
#include <string>

#include "daemon-tracking/source/camera/camera_health.h"
#include "daemon-tracking/source/camera/v4l2_stream.h"
#include "daemon-tracking/source/camera/v4l2_system.h"

namespace handloft::tracking {

/// The functions are the capture thread's, but health().
class CameraMonitor {
 public:
  CameraMonitor(double asked_rate_hz, double slow_rate_part) : slow_rate_part_(slow_rate_part) {
    health_.asked_rate_hz = asked_rate_hz;
  }

  CameraHealth health() const;

  /// `compromise` and `note`: what is not as it should be from the start on, in words, or empty.
  void opened(TimePoint now, const V4l2Node& node, const std::string& model, const VideoMode& mode,
              const std::string& compromise, const std::string& note);
  /// It was there and is not any more.
  void lost();
  /// It is not there, and why.
  void absent(const std::string& why);
  void controls(const ControlReport& report);
  /// The stream's counters after a turn; true when a buffer had been filled since the last call.
  bool counted(const StreamCounters& counters);
  void frame(TimePoint arrival, TimePoint capture, bool estimated, StampPoint point);
  /// Every second since opened() the rates are reckoned and the problem is worded anew: true then.
  bool second_passed(TimePoint now);

 private:
  std::string words(double seconds) const;

  const double slow_rate_part_;
  mutable std::mutex mutex_;
  CameraHealth health_;  ///< Guarded by mutex_; all below is the capture thread's.
  StreamCounters seen_;
  std::string from_start_;
  std::string controls_;
  TimePoint window_start_;
  struct Window {
    std::uint64_t filled = 0, refused = 0, frames = 0, estimated = 0;
  } window_;
  bool first_window_ = true;
};

}  // namespace handloft::tracking
