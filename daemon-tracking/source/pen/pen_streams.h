#pragma once
// The pen without a tablet (T1): simulated, and out of a recording, behind the same interface and as the same
// bytes.

#include <filesystem>
#include <memory>

#include "common/base/clock.h"
#include "daemon-tracking/source/paced_source.h"
#include "daemon-tracking/source/pen/pen_events.h"
#include "daemon-tracking/source/pen/pen_source.h"

namespace handloft::tracking {

/// A pen that comes near, draws one lying eight with swelling pressure and changing tilt, turns round to
/// erase, and leaves again; 200 frames a second.
struct SimulatedPenOptions {
  TimePoint start;
  double seconds = 10.0;
  Duration delay = std::chrono::microseconds(500);  ///< From the kernel's time to ours.
};

/// The facts of the simulated tablet: 216 mm x 135 mm at 100 units per mm, 8192 levels, tilt in degrees.
PenFacts simulated_pen_facts();
/// Where the simulated pen is at `seconds` after the start, in m from the tablet's lower left corner, y away
/// from the designer.
struct SimulatedPenTruth {
  bool in_proximity = false;
  bool eraser = false;
  double x_m = 0.0, y_m = 0.0;
  double pressure = 0.0;
  double tilt_x_rad = 0.0, tilt_y_rad = 0.0;
};
SimulatedPenTruth simulated_pen_at(const SimulatedPenOptions& options, double seconds);

std::unique_ptr<SampleStream> simulated_pen_stream(const SimulatedPenOptions& options);
std::unique_ptr<PenSource> make_simulated_pen(const SimulatedPenOptions& options, const Clock& clock,
                                              PaceOptions pace = {});
/// Errors: as RecordedStream::open.
Result<std::unique_ptr<PenSource>> open_recorded_pen(const std::filesystem::path& path, const Clock& clock,
                                                     PaceOptions pace = {});

}  // namespace handloft::tracking
