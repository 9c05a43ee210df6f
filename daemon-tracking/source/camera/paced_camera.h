#pragma once
// A camera whose samples come from a stream: what simulated and recorded cameras have in common.

#include "daemon-tracking/source/camera/camera_source.h"
#include "daemon-tracking/source/paced_source.h"

namespace handloft::tracking {

class PacedCamera final : public CameraSource {
 public:
  PacedCamera(std::uint32_t camera, std::string name, std::unique_ptr<SampleStream> stream,
              const Clock& clock, PaceOptions options)
      : camera_(camera), source_(std::move(name), std::move(stream), clock, options) {}

  std::uint32_t camera() const override { return camera_; }
  const std::string& name() const override { return source_.name(); }
  Status start(SampleSink sink) override { return source_.start(std::move(sink)); }
  void stop() override { source_.stop(); }
  bool finished() const override { return source_.finished(); }

 private:
  std::uint32_t camera_;
  PacedSource source_;
};

}  // namespace handloft::tracking
