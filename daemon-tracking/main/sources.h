#pragma once
// Which devices the options ask for: those of this computer, or one stream of all samples in order of
// arrival, simulated or recorded.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/record/recording.h"
#include "daemon-tracking/main/device_sources.h"
#include "daemon-tracking/main/options.h"
#include "daemon-tracking/source/calibration_file.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

/// How the reading of a recording ended; all empty for other sources.
struct ReplayEnd {
  std::optional<Error> error;  ///< The file is damaged; what came before it was played.
  record::RecordingEnd end = record::RecordingEnd::complete;
};

struct SourceSet {
  Calibration calibration;                         ///< With the rig.
  std::unique_ptr<SampleStream> stream;            ///< Simulated or recorded; else null.
  std::unique_ptr<DeviceSources> devices;          ///< Of this computer; else null.
  std::map<std::string, std::string> description;  ///< For the recording's metadata and the report.
  std::shared_ptr<const ReplayEnd> replay_end;     ///< To be read once nobody uses the stream any more.
};

/// The lab's own: what --calibration names, or the default file. Errors: invalid_argument with what to do
/// when there is none, and those of load_calibration.
Result<Calibration> load_lab(const DaemonOptions& options);

/// `start` is when a simulated session begins. Errors: those of the .tilt file or the recording, naming it;
/// unsupported for a recording of another rig; for devices those of load_lab and of DeviceSources::open.
Result<SourceSet> open_sources(const DaemonOptions& options, TimePoint start, const Clock& clock,
                               const Logger& log);

}  // namespace handloft::tracking
