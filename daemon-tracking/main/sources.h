#pragma once
// Which devices the options ask for: one stream of all samples in order of arrival.

#include <map>
#include <memory>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "daemon-tracking/main/options.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/sample_source.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

struct SourceSet {
  Rig rig;
  std::unique_ptr<SampleStream> stream;
  std::map<std::string, std::string> description;  ///< For the recording's metadata and the report.
};

/// `start` is when a simulated session begins. Errors: those of the .tilt file or the recording, naming it;
/// unsupported for a recording of another rig.
Result<SourceSet> open_sources(const DaemonOptions& options, TimePoint start);

}  // namespace handloft::tracking
