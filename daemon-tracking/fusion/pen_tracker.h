#pragma once
// The pen's state from its events: complete at each SYN_REPORT and never in between, in metres by the
// tablet's own resolution, with the kernel's time of the event (T4). Pure.

#include <cstdint>
#include <optional>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/source/pen/pen_events.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

struct PenOptions {
  /// Of the active area, for a tablet that doesn't know its resolution: a medium one.
  double assumed_width_m = 0.216;
  /// The kernel's time may be this far from the arrival; beyond, its clock isn't ours and the arrival counts.
  Duration plausible_delay = std::chrono::seconds(1);
};

class PenTracker {
 public:
  explicit PenTracker(const PenOptions& options = {}) : options_(options) {}

  /// Facts or events. Errors: those of the parsers; failed_precondition for events before any facts. Errors
  /// leave the state as it was.
  Status consume(const DeviceBytes& bytes);
  /// Unplugged: out of proximity, nothing pressed.
  void device_gone(TimePoint time);

  void describe(FusedPen& pen) const { pen = state_; }
  /// How often the kernel lost events.
  std::uint64_t overruns() const { return overruns_; }

 private:
  struct Raw {
    std::int32_t x = 0, y = 0, pressure = 0, tilt_x = 0, tilt_y = 0;
    bool pen = false, rubber = false;
    std::uint32_t buttons = 0;
  };

  void take(const PenEvent& event);
  void complete(TimePoint time);

  PenOptions options_;
  std::optional<PenFacts> facts_;
  Raw raw_;
  FusedPen state_;
  std::uint64_t overruns_ = 0;
};

}  // namespace handloft::tracking
