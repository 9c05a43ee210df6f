#pragma once
// The glove as the daemon sees it (T1, T9): delivers GloveBytes samples, one per HID report (or DeviceBytes,
// one per line of a serial glove), unparsed, and DevicePresence when it comes or goes. Implementations beside
// this file: hid_glove.h, serial_glove.h, simulated_glove.h, recorded_glove.h.

#include "daemon-tracking/source/device_status.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/sample_source.h"

namespace handloft::tracking {

class GloveSource : public SampleSource {
 public:
  /// Light and vibration. Quick: hands it on to the glove's own thread, of several in a row only the newest
  /// is shown. A glove that can't or isn't there ignores it. Any thread.
  virtual void show(const GloveOutput& /*output*/) {}

  /// The range that the glove keeps. Errors: unsupported for a glove that keeps none; not_found when it isn't
  /// there; io, timeout. Any thread but the sink's.
  virtual Result<GloveRange> range() {
    return make_error(ErrorCode::unsupported, "this glove keeps no range of its own", "glove");
  }
  /// Stores it in the glove, reads it back, and hands it on as a sample. Errors: as range(); data_corrupt
  /// when it reads back otherwise.
  virtual Status set_range(const GloveRange& /*range*/) {
    return make_error(ErrorCode::unsupported, "this glove keeps no range of its own", "glove");
  }

  virtual DeviceStatus status() const { return {}; }
};

}  // namespace handloft::tracking
