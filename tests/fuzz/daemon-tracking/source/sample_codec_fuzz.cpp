// T13: any bytes are a sample or an error; a sample that is accepted is written back as the very same bytes.

#include <algorithm>
#include <cstdlib>

#include "daemon-tracking/source/sample_codec.h"

using namespace handloft::tracking;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  const auto sample = decode_sample(bytes);
  if (!sample) return 0;
  const auto again = encode_sample(*sample);
  if (!again || !std::equal(bytes.begin(), bytes.end(), again->begin(), again->end())) std::abort();
  return 0;
}
