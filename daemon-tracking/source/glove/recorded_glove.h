#pragma once
// A recorded glove behind the daemon's glove interface.

#include <filesystem>
#include <memory>

#include "daemon-tracking/source/glove/glove_source.h"
#include "daemon-tracking/source/paced_source.h"

namespace handloft::tracking {

/// Errors: as RecordedStream::open.
Result<std::unique_ptr<GloveSource>> open_recorded_glove(const std::filesystem::path& path,
                                                         const Clock& clock, PaceOptions options = {});

}  // namespace handloft::tracking
