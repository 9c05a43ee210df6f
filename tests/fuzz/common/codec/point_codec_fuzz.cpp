// Any bytes as a PointCloud: refused, or decoded and merged into something that indexes itself, never a
// crash.

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "common/codec/point_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  handloft::v1::PointCloud message;
  if (!message.ParseFromArray(data, static_cast<int>(size))) return 0;
  const auto tail = handloft::codec::decode_points(message);
  if (!tail) return 0;
  handloft::codec::PointTail held;
  if (handloft::codec::merge_points(held, *tail)) {
    for (const std::uint16_t style : held.styles) {
      if (style >= held.palette.size()) std::abort();
    }
  }
  return 0;
}
