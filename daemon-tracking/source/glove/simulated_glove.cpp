#include "daemon-tracking/source/glove/simulated_glove.h"

#include "daemon-tracking/source/glove/paced_glove.h"

namespace handloft::tracking {

std::unique_ptr<GloveSource> make_simulated_glove(std::shared_ptr<const SimulatedScene> scene,
                                                  const Clock& clock, PaceOptions options) {
  return std::make_unique<PacedGlove>(simulated_glove_stream(std::move(scene)), clock, options);
}

}  // namespace handloft::tracking
