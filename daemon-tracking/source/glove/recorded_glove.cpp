#include "daemon-tracking/source/glove/recorded_glove.h"

#include "daemon-tracking/source/paced_device.h"
#include "daemon-tracking/source/recorded/recorded_stream.h"

namespace handloft::tracking {

Result<std::unique_ptr<GloveSource>> open_recorded_glove(const std::filesystem::path& path,
                                                         const Clock& clock, PaceOptions options) {
  auto stream = RecordedStream::open(path, {RecordedSelection::Kind::glove, 0, "glove"});
  if (!stream) return stream.error();
  return std::unique_ptr<GloveSource>(
      std::make_unique<PacedDevice<GloveSource>>("glove", std::move(*stream), clock, options));
}

}  // namespace handloft::tracking
