#pragma once
// What a rig's cameras and glove say for some seconds, drawn beforehand, so that drawing costs nothing while
// the daemon is measured.

#include <memory>
#include <vector>

#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

/// The default rig with `cameras` of 640 x 480: two to the table and, from three on, the head's; a fourth to
/// the table from the left side. 2 to 4.
Rig rig_with_cameras(int cameras);

struct PrerenderedSession {
  Rig rig;
  std::vector<Sample> samples;
};

/// The first `seconds` of the tour before `cameras` cameras of `rate_hz`.
PrerenderedSession prerender(int cameras, double rate_hz, double seconds);

/// Gives out the samples once; they share their pictures with the session.
std::unique_ptr<SampleStream> stream_of(const PrerenderedSession& session);

}  // namespace handloft::tracking
