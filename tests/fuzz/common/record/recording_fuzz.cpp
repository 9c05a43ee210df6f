// Any bytes as a recording: records or an error, never more memory than there are bytes.

#include <cstdlib>

#include "common/record/recording.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace handloft::record;
  auto reader = RecordingReader::from_bytes({data, size}, "fuzz");
  if (!reader) return 0;
  std::size_t total = 0;
  for (auto record = reader->next(); record.ok() && record->has_value(); record = reader->next()) {
    total += (*record)->payload.size();
  }
  if (total > size || reader->offset() > size) std::abort();
  return 0;
}
