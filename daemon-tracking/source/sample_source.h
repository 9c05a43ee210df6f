#pragma once
// What a device is to the rest of the daemon: something that calls a sink with timestamped samples, from a
// thread of its own, until it is stopped. Shutdown has two phases, so that no stage is freed while another
// still writes to it: first `stop()` every source (nothing is delivered any more, all objects still alive),
// then destroy in any order.

#include <functional>
#include <string>

#include "common/base/result.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

/// Called on the source's own thread, one call at a time per source, never after stop() returned. It must be
/// quick: whoever needs time puts the sample into its own latest-only slot or bounded queue.
using SampleSink = std::function<void(Sample)>;

class SampleSource {
 public:
  virtual ~SampleSource() = default;

  /// "camera/left", "glove", "rig": as it stands in DevicePresence and in messages.
  virtual const std::string& name() const = 0;

  /// Begins to deliver to `sink`. Errors: failed_precondition when already started, io when the device can't
  /// be opened.
  virtual Status start(SampleSink sink) = 0;

  /// First phase of the shutdown: when it returns the sink isn't called any more. Idempotent. Not from the
  /// sink itself.
  virtual void stop() = 0;

  /// True when the source will deliver nothing more by itself (end of a recording or of a simulated program).
  virtual bool finished() const = 0;
};

}  // namespace handloft::tracking
