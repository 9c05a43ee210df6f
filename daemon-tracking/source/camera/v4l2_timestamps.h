#pragma once
// When a frame was exposed (T4, tracking.md 5.3). The driver's stamp is taken only if it is of
// CLOCK_MONOTONIC, later than the one before and of a plausible age; otherwise the moment of arrival minus
// the latency that good stamps have shown stands in, and it is told.

#include <cstdint>
#include <optional>

#include "common/base/clock.h"

namespace handloft::tracking {

struct StampOptions {
  /// Older than this when it arrives, a stamp is of another clock or of a frame nobody should use.
  Duration oldest = std::chrono::milliseconds(200);
  /// Some drivers stamp ahead (vivid: when the frame will be due, up to a frame's length).
  Duration furthest_ahead = std::chrono::milliseconds(40);
  /// Between frames, for the latency before any good stamp was seen: a frame is exposed, then read out for up
  /// to one interval.
  Duration frame_interval = std::chrono::microseconds(33333);
  Duration readout{};
  Duration offset{};  ///< From calibration; added to every capture time.
};

enum class StampPoint : std::uint8_t { start_of_exposure, end_of_frame };

/// What the driver said of a frame.
struct DriverStamp {
  std::int64_t ns = 0;
  bool monotonic = false;  ///< V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC
  StampPoint point = StampPoint::end_of_frame;
};

struct FrameStamp {
  TimePoint capture;  ///< Middle of the exposure, strictly increasing from frame to frame.
  bool estimated = false;
};

/// One camera's stamps from STREAMON on. Not thread-safe.
class FrameStamper {
 public:
  explicit FrameStamper(StampOptions options) : options_(options) {}

  /// `exposure` 0: not known. `arrival` is when the buffer was dequeued.
  FrameStamp stamp(const DriverStamp& driver, TimePoint arrival, Duration exposure);

  /// Arrival minus capture (before the calibrated offset) of good stamps, smoothed; nullopt before the first.
  std::optional<Duration> learned_latency() const { return latency_; }

 private:
  std::optional<Duration> trusted_age(const DriverStamp& driver, TimePoint arrival);

  StampOptions options_;
  std::optional<std::int64_t> last_driver_ns_;
  std::optional<TimePoint> last_capture_;
  std::optional<Duration> latency_;
  Duration ahead_{};  ///< How far ahead of arrival stamps were seen; taken off all, to keep their spacing.
};

}  // namespace handloft::tracking
