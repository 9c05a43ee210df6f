#pragma once
// Which devices the options ask for: one stream of all samples in order of arrival.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/record/recording.h"
#include "daemon-tracking/main/options.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/sample_source.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

/// How the reading of a recording ended; all empty for other sources.
struct ReplayEnd {
  std::optional<Error> error;  ///< The file is damaged; what came before it was played.
  record::RecordingEnd end = record::RecordingEnd::complete;
};

struct SourceSet {
  Rig rig;
  std::unique_ptr<SampleStream> stream;
  std::map<std::string, std::string> description;  ///< For the recording's metadata and the report.
  std::shared_ptr<const ReplayEnd> replay_end;     ///< To be read once nobody uses the stream any more.
};

/// `start` is when a simulated session begins. Errors: those of the .tilt file or the recording, naming it;
/// unsupported for a recording of another rig.
Result<SourceSet> open_sources(const DaemonOptions& options, TimePoint start);

}  // namespace handloft::tracking
