#pragma once
// A device whose samples come from a stream: what simulated and recorded gloves, pens and 3D mice have in
// common. `Device` is their interface (glove_source.h, ...); what it asks for beside samples keeps its
// defaults.

#include <memory>
#include <string>
#include <utility>

#include "daemon-tracking/source/paced_source.h"

namespace handloft::tracking {

template <typename Device>
class PacedDevice final : public Device {
 public:
  PacedDevice(std::string name, std::unique_ptr<SampleStream> stream, const Clock& clock, PaceOptions pace)
      : source_(std::move(name), std::move(stream), clock, pace) {}

  const std::string& name() const override { return source_.name(); }
  Status start(SampleSink sink) override { return source_.start(std::move(sink)); }
  void stop() override { source_.stop(); }
  bool finished() const override { return source_.finished(); }

 private:
  PacedSource source_;
};

}  // namespace handloft::tracking
