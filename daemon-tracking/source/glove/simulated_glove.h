#pragma once
// A simulated glove behind the daemon's glove interface.

#include <memory>

#include "daemon-tracking/source/glove/glove_source.h"
#include "daemon-tracking/source/paced_source.h"
#include "daemon-tracking/source/simulated/simulated_rig.h"

namespace handloft::tracking {

std::unique_ptr<GloveSource> make_simulated_glove(std::shared_ptr<const SimulatedScene> scene,
                                                  const Clock& clock, PaceOptions options = {});

}  // namespace handloft::tracking
