#pragma once
// A glove whose samples come from a stream: what simulated and recorded gloves have in common.

#include "daemon-tracking/source/glove/glove_source.h"
#include "daemon-tracking/source/paced_source.h"

namespace handloft::tracking {

class PacedGlove final : public GloveSource {
 public:
  PacedGlove(std::unique_ptr<SampleStream> stream, const Clock& clock, PaceOptions options)
      : source_("glove", std::move(stream), clock, options) {}

  const std::string& name() const override { return source_.name(); }
  Status start(SampleSink sink) override { return source_.start(std::move(sink)); }
  void stop() override { source_.stop(); }
  bool finished() const override { return source_.finished(); }

 private:
  PacedSource source_;
};

}  // namespace handloft::tracking
