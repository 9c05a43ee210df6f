#include "daemon-tracking/source/glove/simulated_glove.h"

#include "daemon-tracking/source/paced_device.h"

namespace handloft::tracking {

std::unique_ptr<GloveSource> make_simulated_glove(std::shared_ptr<const SimulatedScene> scene,
                                                  const Clock& clock, PaceOptions options) {
  return std::make_unique<PacedDevice<GloveSource>>("glove", simulated_glove_stream(std::move(scene)), clock,
                                                    options);
}

}  // namespace handloft::tracking
