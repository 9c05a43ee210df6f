#pragma once
// The 3D mouse without one (T1): simulated, and out of a recording, behind the same interface and as the same
// bytes.

#include <array>
#include <filesystem>
#include <memory>

#include "common/base/clock.h"
#include "daemon-tracking/source/paced_source.h"
#include "daemon-tracking/source/space_mouse/space_mouse_source.h"

namespace handloft::tracking {

enum class SpaceMouseForm : std::uint8_t { split, combined };

/// A cap that is pushed and twisted about one axis after the other, a second each, in a half sine, with a
/// button pressed during every second one; 60 reports a second.
struct SimulatedSpaceMouseOptions {
  TimePoint start;
  double seconds = 12.0;
  SpaceMouseForm form = SpaceMouseForm::split;
};

/// Raw values of the six axes, the cap's own (translation x, y, z, rotation x, y, z), `seconds` after the
/// start.
std::array<std::int16_t, 6> simulated_space_mouse_at(double seconds);

std::unique_ptr<SampleStream> simulated_space_mouse_stream(const SimulatedSpaceMouseOptions& options);
std::unique_ptr<SpaceMouseSource> make_simulated_space_mouse(const SimulatedSpaceMouseOptions& options,
                                                             const Clock& clock, PaceOptions pace = {});
/// Errors: as RecordedStream::open.
Result<std::unique_ptr<SpaceMouseSource>> open_recorded_space_mouse(const std::filesystem::path& path,
                                                                    const Clock& clock,
                                                                    PaceOptions pace = {});

}  // namespace handloft::tracking
